#include "configs/docking/modules/pixel_study/study_options.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <hil/numbers.hpp>

#include "configs/docking/modules/docking_port/port_parameter.hpp"

namespace hil::modules {
namespace {

constexpr std::uint32_t max_samples_per_axis = 256;

/// The square root of a number of samples; 0 with a mistake if it is not a square.
std::uint32_t root_of(const config::Value& samples, config::Diagnostics& diagnostics) {
  const std::int64_t number = samples.integer();
  const std::int64_t root = std::llround(std::sqrt(static_cast<double>(number)));
  if (root * root == number) return static_cast<std::uint32_t>(root);
  diagnostics.add(samples.place(), std::to_string(number) + " samples are no square of " +
                                       "whole numbers; the nearest one is " + std::to_string(root * root));
  return 0;
}

void read_distances(const config::Value& parameters, StudyOptions& options,
                    config::Diagnostics& diagnostics) {
  for (const config::Value& distance : parameters["distances"].items()) {
    const std::string metres = config::format_number(distance.number()) + " m";
    if (std::ranges::count(options.distances_m, distance.number()) > 0)
      diagnostics.add(distance.place(), "the distance of " + metres + " is given twice");
    if (distance.number() > options.range_m)
      diagnostics.add(distance.place(), "a distance of " + metres + " is beyond the 'range' of " +
                                            config::format_number(options.range_m) + " m");
    options.distances_m.push_back(distance.number());
  }
}

void read_methods(const config::Value& parameters, StudyOptions& options, config::Diagnostics& diagnostics) {
  for (const config::Value& samples : parameters["samples"].items()) {
    if (const std::uint32_t root = root_of(samples, diagnostics); root > 0)
      options.methods.push_back({.samples_per_axis = root});
  }
  for (const config::Value& beam : parameters["beams"].items())
    options.methods.push_back({.beam_rad = beam.number()});
  std::ranges::stable_sort(options.methods, [](const PixelMethod& a, const PixelMethod& b) {
    return a.beam_rad != b.beam_rad ? a.beam_rad < b.beam_rad : a.samples_per_axis < b.samples_per_axis;
  });
  const auto same = std::ranges::adjacent_find(options.methods, {}, name_of);
  if (same != options.methods.end()) {
    const char* const list = same->is_beam() ? "beams" : "samples";
    diagnostics.add(parameters[list].place(), name_of(*same) + " is given twice");
  }
  if (options.methods.empty())
    diagnostics.add(parameters.place(), "the study has neither 'samples' nor 'beams'; it needs one of them");
}

/// An image for each distance and method, with a byte for each pixel.
void check_images(const config::Value& parameters, const StudyOptions& options,
                  config::Diagnostics& diagnostics) {
  constexpr std::uint64_t max_bytes = std::uint64_t{2} << 30;
  const std::uint64_t bytes =
      std::uint64_t{options.pixels} * options.pixels * options.distances_m.size() * options.methods.size();
  if (bytes <= max_bytes) return;
  diagnostics.add(parameters["pixels"].place(), "the images of all distances and methods take " +
                                                    std::to_string(bytes) + " bytes; at most " +
                                                    std::to_string(max_bytes) +
                                                    " are possible: use fewer pixels, or 'images: false'");
}

}  // namespace

std::optional<StudyOptions> read_study_options(const config::Value& parameters,
                                               config::Diagnostics& diagnostics) {
  const std::size_t mistakes_before = diagnostics.count();
  StudyOptions options;
  const config::Value& port = parameters["port"];
  options.body = port["body"].text();
  if (const auto body_port = read_port(port, diagnostics)) options.port = *body_port;
  options.port_radius_m = port["radius"].number();
  options.reflector = parameters["reflector"].text();
  options.reflector_m = parameters["reflector_size"].number();
  options.range_m = parameters["range"].number();
  read_distances(parameters, options, diagnostics);
  read_methods(parameters, options, diagnostics);
  options.pixels = static_cast<std::uint32_t>(parameters["pixels"].integer());
  options.field_of_view_rad = parameters["field_of_view"].number();
  for (const config::Value& layer : parameters["layers"].items())
    options.layers.push_back(layer.text());
  options.threshold_per_m2 = parameters["threshold"].number();
  options.shifts = static_cast<std::uint32_t>(parameters["shifts"].integer());
  options.needed_shifts = static_cast<std::uint32_t>(parameters["needed_shifts"].integer());
  options.all_pixels_up_to_samples =
      static_cast<std::uint32_t>(parameters["all_pixels_up_to_samples"].integer());
  options.share_beside_port = parameters["share_beside_port"].number();
  options.mode = parameters["mode"].text() == "fast" ? rtstdb::ConeMode::fast : rtstdb::ConeMode::exact;
  options.batch = static_cast<std::uint32_t>(parameters["batch"].integer());
  options.images = parameters["images"].boolean();
  if (options.needed_shifts > options.shifts) {
    diagnostics.add(parameters["needed_shifts"].place(),
                    "'needed_shifts' is " + std::to_string(options.needed_shifts) + " of " +
                        std::to_string(options.shifts) + " 'shifts'; at most all can be needed");
  }
  if (options.images) check_images(parameters, options, diagnostics);
  if (diagnostics.count() != mistakes_before) return std::nullopt;
  return options;
}

config::Schema study_schema() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  constexpr double pi = std::numbers::pi;
  const auto length = Schema::quantity(Quantity::length_m, 1e-6, 1e4);
  auto port = port_fields();
  port.push_back(Field::with_default("radius", length, "1 m",
                                     "The radius of the port: pixels that see into it see the port."));
  return Schema::record({
      Field::needed("port", Schema::record(port),
                    "The port that the sensor looks at, from points on its axis."),
      Field::needed("reflector", Schema::text(),
                    "The body that has to be detected; it is in one of the layers."),
      Field::needed("reflector_size", length,
                    "Its size across the line of sight, for Equation 2 and for the pixels that can see it."),
      Field::needed("distances", Schema::list(length, 1, 64), "From the port to the sensor."),
      Field::with_default(
          "samples", Schema::list(Schema::integer(1, max_samples_per_axis * max_samples_per_axis), 0, 16),
          "[]", "Numbers of rays in a pixel, squares of whole numbers."),
      Field::with_default("beams", Schema::list(Schema::quantity(Quantity::angle_rad, 1e-5, 0.5), 0, 16),
                          "[]", "Full opening angles of the one beam in a pixel."),
      Field::with_default("pixels", Schema::integer(8, 4096), "1080", "Pixels in a row, and in a column."),
      Field::with_default("field_of_view", Schema::quantity(Quantity::angle_rad, 1e-3, 0.5 * pi), "40 deg",
                          "Horizontal and vertical field of view."),
      Field::with_default("range", Schema::quantity(Quantity::length_m, 0.1, 1e5), "2 km",
                          "The range of rays and beams."),
      Field::needed("layers", Schema::list(Schema::text(), 1, 32), "Layers that rays and beams hit."),
      Field::with_default("threshold", Schema::number(0.0, 1e12), "0",
                          "The intensity, in 1/m^2, above which a pixel detects the reflector: reflectance "
                          "times gain times the fraction of rays, or of the beam, over range squared."),
      Field::with_default("shifts", Schema::integer(1, 1000), "10",
                          "Random shifts of the grid within a pixel, for which detections are counted."),
      Field::with_default("needed_shifts", Schema::integer(1, 1000), "9",
                          "The number of shifts with a detection that a method needs to detect."),
      Field::with_default(
          "all_pixels_up_to_samples", Schema::integer(0, 65536), "16",
          "With up to this number of rays in a pixel, all pixels are traced; with more, all that can see "
          "the port and a random share of the others."),
      Field::with_default(
          "share_beside_port", Schema::quantity(Quantity::share, 0.0, 1.0), "0.1 %",
          "The share of the pixels that can not see the port; the time of a frame is estimated from it."),
      Field::with_default("mode", Schema::one_of({"exact", "fast"}), "exact",
                          "How the fractions of beams are found, as of a laser_scanner."),
      Field::with_default("batch", Schema::integer(1024, 1 << 20), "65536",
                          "Rays or beams that one step of the task traces."),
      Field::with_default("images", Schema::boolean(), "true", "Whether the run writes images."),
  });
}

std::string name_of(const PixelMethod& method) {
  if (!method.is_beam()) {
    const std::uint32_t samples = method.samples();
    return std::to_string(samples) + (samples == 1 ? " ray" : " rays");
  }
  const double degrees = method.beam_rad * 180.0 / std::numbers::pi;
  return "beam of " + config::format_number(std::round(degrees * 1e6) / 1e6) + "°";
}

}  // namespace hil::modules
