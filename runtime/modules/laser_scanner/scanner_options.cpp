#include "runtime/modules/laser_scanner/scanner_options.hpp"

#include <cmath>

#include <hil/numbers.hpp>
#include <hil/world/beam_query.hpp>
#include <hil/world/vector_parameter.hpp>
#include <rtstdb/limits.hpp>

#include "runtime/modules/laser_scanner/target_list.hpp"

namespace hil::modules {
namespace {

std::vector<std::string> texts(const config::Value& list) {
  std::vector<std::string> result;
  for (const config::Value& item : list.items())
    result.push_back(item.text());
  return result;
}

/// Rates are decimal numbers, which may be rounded.
constexpr double rate_tolerance = 1e-9;

double sweeps_per_cloud(const config::Value& parameters) {
  return parameters["scan_rate"].number() / parameters["point_cloud"]["rate"].number();
}

}  // namespace

ScannerOptions read_scanner_options(const config::Value& parameters) {
  ScannerOptions options;
  options.carrier = parameters["carrier"].text();
  options.mount_m = vector_of(parameters["mount"]);
  options.list_origin_m = vector_of(parameters["list_origin"]);
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
  options.divergence_rad = parameters["divergence"].number();
  options.returns_per_beam = static_cast<std::uint32_t>(parameters["returns"].integer());
  options.mode = parameters["mode"].text() == "fast" ? rtstdb::ConeMode::fast : rtstdb::ConeMode::exact;
  options.threshold_per_m2 = parameters["threshold"].number();
  options.range_noise_m = parameters["range_noise"].number();
  options.targets = static_cast<std::uint32_t>(parameters["targets"].integer());
  if (parameters.has("point_cloud"))
    options.cloud_sweeps = static_cast<std::uint32_t>(std::lround(sweeps_per_cloud(parameters)));
  return options;
}

void check_scanner_options(const config::Value& parameters, config::Diagnostics& diagnostics) {
  const ScannerOptions options = read_scanner_options(parameters);
  for (const config::Value& body : parameters["compare"].items()) {
    if (body.text() == options.carrier)
      diagnostics.add(body.place(), "'compare': " + config::in_quotes(options.carrier) +
                                        " carries the scanner, so its beams do not sweep over it");
    if (options.divergence_rad > 0.0)
      diagnostics.add(body.place(), "'compare' measures with rays; it needs a divergence of 0 deg");
  }
  if (!parameters.has("point_cloud")) return;
  const config::Value& rate = parameters["point_cloud"]["rate"];
  const double ratio = sweeps_per_cloud(parameters);
  if (ratio < 1.0 - rate_tolerance) {
    diagnostics.add(rate.place(), "'rate': " + config::format_number(rate.number()) +
                                      " Hz is above 'scan_rate': a cloud is one sweep");
  } else if (std::abs(ratio - std::round(ratio)) > rate_tolerance * ratio) {
    const double sweeps_hz = parameters["scan_rate"].number();
    diagnostics.add(rate.place(), "'rate': a cloud is one sweep of 'scan_rate'; the nearest rates are " +
                                      config::format_number(sweeps_hz / std::ceil(ratio)) + " Hz and " +
                                      config::format_number(sweeps_hz / std::floor(ratio)) + " Hz");
  }
  const std::uint64_t points =
      std::uint64_t{options.pattern.columns} * options.pattern.rows * options.returns_per_beam;
  if (points > max_cloud_points)
    diagnostics.add(parameters["point_cloud"].place(),
                    "'point_cloud': a sweep has up to " + std::to_string(points) + " returns; at most " +
                        std::to_string(max_cloud_points) + " are possible: use fewer beams or returns");
}

void check_scanner_task(const config::Value& parameters, const ScanPattern& pattern, std::int64_t step_ns,
                        config::Diagnostics& diagnostics) {
  const std::int64_t sweep_ns = pattern.options().period_ns;
  if (sweep_ns % step_ns != 0) {
    const auto rate_of = [&](std::int64_t steps) {
      const double sweep_s = static_cast<double>(steps * step_ns) * 1e-9;
      return config::format_number(1.0 / sweep_s) + " Hz";
    };
    const std::int64_t fewer = sweep_ns / step_ns;
    diagnostics.add(parameters["scan_rate"].place(),
                    "'scan_rate': a sweep of " + std::to_string(sweep_ns) +
                        " ns is not a whole number of the task's periods of " + std::to_string(step_ns) +
                        " ns; with " + (fewer > 0 ? rate_of(fewer) + " or " : "") + rate_of(fewer + 1) +
                        " it is");
    return;
  }
  const std::uint64_t beams = pattern.max_beams_in_step(step_ns);
  const std::uint32_t max_beams = BeamQuery::max_capacity(parameters["divergence"].number());
  if (beams > max_beams) {
    diagnostics.add(parameters["columns"].place(),
                    "a sweep of " + std::to_string(pattern.beams()) + " beams has " + std::to_string(beams) +
                        " in a step of the task; at most " + std::to_string(max_beams) +
                        " are possible: use fewer beams or a faster task");
  }
  if (!parameters["ignore_motion"].boolean() && step_ns > rtstdb::max_query_window_ns) {
    diagnostics.add(parameters["scan_rate"].place(),
                    "the beams of a step leave within the task's period of " + std::to_string(step_ns) +
                        " ns; at most " + std::to_string(rtstdb::max_query_window_ns) +
                        " ns are possible: use a faster task");
  }
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
      Field::with_default("divergence", Schema::quantity(Quantity::angle_rad, 0.0, 0.5 * pi), "0 deg",
                          "The full opening angle of a beam. 0: a beam is a ray."),
      Field::with_default("returns", Schema::integer(1, rtstdb::max_returns_per_cone), "1",
                          "The largest number of returns of a beam, the nearest first. A beam without "
                          "divergence has one."),
      Field::with_default("mode", Schema::one_of({"exact", "fast"}), "exact",
                          "How the fractions of beams with a divergence are found: from the exact areas that "
                          "bodies cover, or, for bodies that cover an eighth of the beam or more, along 64 "
                          "directions, which is faster for bodies of many triangles. Fast beams also use the "
                          "distance fields of entities ('field')."),
      Field::with_default("threshold", Schema::number(0.0, 1e12), "0",
                          "The intensity, in 1/m^2, at and below which a return is not detected."),
      Field::with_default("range_noise", Schema::quantity(Quantity::length_m, 0.0, 100.0), "0 m",
                          "The standard deviation of the measured range."),
      Field::with_default(
          "targets", Schema::integer(0, TargetList::max_targets), "0",
          "Slots for the brightest returns of retro-reflectors in a sweep. 0: no such outputs."),
      Field::optional(
          "point_cloud",
          Schema::record({Field::needed("rate", Schema::quantity(Quantity::frequency_hz, 0.001, 100.0),
                                        "Clouds per second; it divides scan_rate.")}),
          "The run writes sweeps as point clouds (PCD), in its folder pointclouds. Left out: none."),
      Field::with_default("compare", Schema::list(Schema::text(), 0, 8), "[]",
                          "Bodies whose apparent length the report compares with the closed form. The sweep "
                          "is then also traced without motion, which doubles its cost."),
  });
}

}  // namespace hil::modules
