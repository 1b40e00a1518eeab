#include "runtime/modules/laser_scanner/scanner_ports.hpp"

#include <string>
#include <utility>

namespace hil::modules {
namespace {

void add_object(std::vector<Port>& outputs, const std::string& object) {
  outputs.push_back({.name = object + ".valid", .unit = "", .about = "1: the slot holds an object"});
  outputs.push_back({.name = object + ".x", .unit = "m", .about = "Centre, ahead of the list's origin"});
  outputs.push_back({.name = object + ".y", .unit = "m", .about = "Centre, left of the list's origin"});
  outputs.push_back({.name = object + ".vx", .unit = "m/s", .about = "Over ground, along the carrier's x"});
  outputs.push_back({.name = object + ".vy", .unit = "m/s", .about = "Over ground, along the carrier's y"});
  outputs.push_back({.name = object + ".length", .unit = "m", .about = "Measured, along its velocity"});
  outputs.push_back({.name = object + ".age", .unit = "ms", .about = "Time since it was measured"});
}

void add_target(std::vector<Port>& outputs, const std::string& target) {
  outputs.push_back({.name = target + ".azimuth", .unit = "rad", .about = "Of the beam's axis, to the left"});
  outputs.push_back({.name = target + ".elevation", .unit = "rad", .about = "Of the beam's axis, upward"});
  outputs.push_back({.name = target + ".range", .unit = "m", .about = "Measured range; 0: no target"});
  outputs.push_back({.name = target + ".intensity", .unit = "1/m^2", .about = "Intensity of the return"});
}

}  // namespace

WorldPorts scanner_ports(const config::Value& parameters, const ScannerOptions& options) {
  WorldPorts ports;
  const auto note = [&](const char* key, std::vector<config::Word>& words) {
    for (const config::Value& item : parameters[key].items())
      words.push_back({item.text(), item.place()});
  };
  ports.bodies.push_back({options.carrier, parameters["carrier"].place()});
  for (const char* const key : {"layers", "object_layers"}) {
    BodySearch search{.layers = {}, .without = ports.bodies, .is_whole_purpose = false};
    note(key, search.layers);
    ports.layers.insert(ports.layers.end(), search.layers.begin(), search.layers.end());
    ports.searches.push_back(std::move(search));
  }
  note("compare", ports.bodies);
  std::vector<Port>& outputs = ports.outputs;
  for (std::uint32_t i = 0; i < options.max_objects; ++i)
    add_object(outputs, "object" + std::to_string(i));
  outputs.push_back({.name = "object_count", .unit = "", .about = "Slots that hold an object"});
  outputs.push_back({.name = "scan_index", .unit = "", .about = "Sweeps begun before this one"});
  outputs.push_back(
      {.name = "hits", .unit = "", .about = "Beams of the last step of which a return was detected"});
  outputs.push_back({.name = "digest", .unit = "", .about = "Hash of all answers so far"});
  if (options.targets > 0)
    outputs.push_back({.name = "target_count",
                       .unit = "",
                       .about = "Detected returns of retro-reflectors in the last sweep"});
  for (std::uint32_t k = 0; k < options.targets; ++k)
    add_target(outputs, "target" + std::to_string(k));
  return ports;
}

}  // namespace hil::modules
