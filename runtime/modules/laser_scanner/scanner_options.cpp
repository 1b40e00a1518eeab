#include "runtime/modules/laser_scanner/scanner_options.hpp"

#include <cmath>

namespace hil::modules {
namespace {

std::vector<std::string> texts(const config::Value& list) {
  std::vector<std::string> result;
  for (const config::Value& item : list.items())
    result.push_back(item.text());
  return result;
}

glm::dvec3 three(const config::Value& list) {
  return {list.items()[0].number(), list.items()[1].number(), list.items()[2].number()};
}

}  // namespace

ScannerOptions read_scanner_options(const config::Value& parameters) {
  ScannerOptions options;
  options.carrier = parameters["carrier"].text();
  options.mount_m = three(parameters["mount"]);
  options.list_origin_m = three(parameters["list_origin"]);
  options.pattern = {.columns = static_cast<std::uint32_t>(parameters["columns"].integer()),
                     .rows = static_cast<std::uint32_t>(parameters["rows"].integer()),
                     .horizontal_rad = parameters["horizontal"].number(),
                     .vertical_rad = parameters["vertical"].number(),
                     .elevation_rad = parameters["elevation"].number(),
                     .period_ns = std::llround(1e9 / parameters["scan_rate"].number()),
                     .left_to_right = parameters["sweep"].text() == "left_to_right"};
  options.range_m = parameters["range"].number();
  options.layers = texts(parameters["layers"]);
  options.object_layers = texts(parameters["object_layers"]);
  options.compare = texts(parameters["compare"]);
  options.max_objects = static_cast<std::uint32_t>(parameters["max_objects"].integer());
  options.keep_ns = parameters["keep_objects"].duration_ns();
  options.ignore_motion = parameters["ignore_motion"].boolean();
  return options;
}

config::Schema scanner_schema() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  const auto point = Schema::list(Schema::quantity(Quantity::length_m, -100.0, 100.0), 3, 3);
  const auto layers = Schema::list(Schema::text(), 1, 32);
  constexpr double pi = 3.14159265358979323846;
  return Schema::record({
      Field::needed("carrier", Schema::text(), "The body that carries the scanner, as 'module.vehicle'."),
      Field::with_default("mount", point, "[0 m, 0 m, 0 m]",
                          "Position of the scanner in the carrier's frame."),
      Field::with_default("list_origin", point, "[0 m, 0 m, 0 m]",
                          "Origin of the object list, in the carrier's frame."),
      Field::with_default("scan_rate", Schema::quantity(Quantity::frequency_hz, 0.1, 100.0), "1 Hz",
                          "Sweeps per second."),
      Field::with_default("horizontal", Schema::quantity(Quantity::angle_rad, 0.001, 2.0 * pi), "140 deg",
                          "Horizontal field of view."),
      Field::with_default("vertical", Schema::quantity(Quantity::angle_rad, 0.001, pi), "40 deg",
                          "Vertical field of view."),
      Field::with_default("elevation", Schema::quantity(Quantity::angle_rad, -pi, pi), "0 deg",
                          "Elevation of the middle of the field of view."),
      Field::with_default("columns", Schema::integer(2, 16384), "480", "Beams in a sweep."),
      Field::with_default("rows", Schema::integer(1, 8192), "270", "Beams in a column."),
      Field::with_default("sweep", Schema::one_of({"left_to_right", "right_to_left"}), "left_to_right",
                          "The direction in which the beam turns."),
      Field::with_default("range", Schema::quantity(Quantity::length_m, 0.1, 10000.0), "120 m",
                          "The range of a beam."),
      Field::needed("layers", layers, "Layers that beams hit."),
      Field::needed("object_layers", layers, "Layers whose bodies go into the object list."),
      Field::with_default("max_objects", Schema::integer(1, 64), "4", "Slots of the object list."),
      Field::with_default("keep_objects", Schema::quantity(Quantity::duration_s, 0.0, 60.0), "1 s",
                          "How long an object stays in the list without a new hit."),
      Field::with_default("ignore_motion", Schema::boolean(), "false",
                          "Whether bodies stand still during a sweep, whatever the times of the beams."),
      Field::with_default("compare", Schema::list(Schema::text(), 0, 8), "[]",
                          "Bodies whose apparent length the report compares with the closed form. The sweep "
                          "is then also traced without motion, which doubles its cost."),
  });
}

}  // namespace hil::modules
