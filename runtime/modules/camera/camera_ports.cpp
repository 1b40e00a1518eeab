#include "runtime/modules/camera/camera_ports.hpp"

#include <string>
#include <utility>

namespace hil::modules {
namespace {

void add_slot(std::vector<Port>& outputs, const std::string& object) {
  outputs.push_back({.name = object + ".valid", .unit = "", .about = "1: the slot holds an object"});
  outputs.push_back({.name = object + ".entity", .unit = "", .about = "Index of the body in world.json"});
  outputs.push_back({.name = object + ".x_min", .unit = "", .about = "Left edge of its box, in pixels"});
  outputs.push_back({.name = object + ".y_min", .unit = "", .about = "Upper edge of its box, in pixels"});
  outputs.push_back({.name = object + ".x_max", .unit = "", .about = "Right edge of its box, in pixels"});
  outputs.push_back({.name = object + ".y_max", .unit = "", .about = "Lower edge of its box, in pixels"});
  outputs.push_back({.name = object + ".depth", .unit = "m", .about = "Depth of its nearest visible pixel"});
  outputs.push_back({.name = object + ".pixels", .unit = "", .about = "Visible pixels"});
  outputs.push_back({.name = object + ".share",
                     .unit = "",
                     .about = "Visible pixels over those that the body would cover alone"});
  outputs.push_back({.name = object + ".share_exact",
                     .unit = "",
                     .about = "0: pixels are left out of the share, since what they cover is not known"});
}

}  // namespace

WorldPorts camera_ports(const config::Value& parameters, const CameraOptions& options) {
  WorldPorts ports;
  ports.needs_light = options.has_images;
  if (!options.carrier.empty()) ports.bodies.push_back({options.carrier, parameters["carrier"].place()});
  for (const char* const key : {"layers", "object_layers"}) {
    if (!parameters.has(key)) continue;
    BodySearch search{.layers = {}, .without = ports.bodies, .is_whole_purpose = false};
    for (const config::Value& item : parameters[key].items())
      search.layers.push_back({item.text(), item.place()});
    ports.layers.insert(ports.layers.end(), search.layers.begin(), search.layers.end());
    if (options.objects > 0) ports.searches.push_back(std::move(search));
  }
  std::vector<Port>& outputs = ports.outputs;
  outputs.push_back({.name = "image_count", .unit = "", .about = "Images so far"});
  outputs.push_back({.name = "age", .unit = "ms", .about = "Time since the first instant of the last image"});
  outputs.push_back({.name = "missing_tiles", .unit = "", .about = "Tiles that the last image lacks"});
  if (options.objects == 0) return ports;
  outputs.push_back({.name = "object_count", .unit = "", .about = "Bodies of the object layers in view"});
  outputs.push_back({.name = "digest", .unit = "", .about = "Hash of all depths and bodies so far"});
  for (std::uint32_t i = 0; i < options.objects; ++i)
    add_slot(outputs, "object" + std::to_string(i));
  return ports;
}

}  // namespace hil::modules
