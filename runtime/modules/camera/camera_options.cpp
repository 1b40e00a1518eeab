#include "runtime/modules/camera/camera_options.hpp"

#include <cmath>
#include <numbers>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>
#include <hil/rotation.hpp>
#include <hil/world/vector_parameter.hpp>
#include <rtstdb/limits.hpp>

namespace hil::modules {
namespace {

/// Limit of half an angle of view: below that of the database, whose numbers are rounded.
constexpr double max_half_tangent = 0.999 * rtstdb::max_image_half_tangent;
/// Rates are decimal numbers, which may be rounded.
constexpr double rate_slack = 1.0 + 1e-9;

std::vector<std::string> words(const config::Value& parameters, const char* key) {
  std::vector<std::string> result;
  if (!parameters.has(key)) return result;
  for (const config::Value& item : parameters[key].items())
    result.push_back(item.text());
  return result;
}

std::string per_second(double rate_hz) {
  return config::format_number(rate_hz) + " Hz";
}

void check_size(const config::Value& parameters, const CameraOptions& options,
                config::Diagnostics& diagnostics) {
  const std::uint64_t pixels = std::uint64_t{options.width} * options.height;
  if (pixels > max_camera_pixels) {
    diagnostics.add(parameters["resolution"].place(),
                    "'resolution' has " + std::to_string(pixels) + " pixels; at most " +
                        std::to_string(max_camera_pixels) + " are possible");
  }
  const double half_height = std::tan(0.5 * options.field_of_view_rad) * options.height / options.width;
  if (half_height > max_half_tangent) {
    diagnostics.add(parameters["field_of_view"].place(),
                    "'field_of_view' is horizontal: the vertical one of these pixels is " +
                        config::format_number(2.0 * std::atan(half_height) * 180.0 / std::numbers::pi) +
                        " deg; at most 179.88 deg are possible: use fewer rows or a smaller angle");
  }
}

void check_times(const config::Value& parameters, const CameraOptions& options, std::int64_t step_ns,
                 config::Diagnostics& diagnostics) {
  const double task_hz = 1e9 / static_cast<double>(step_ns);
  if (options.images_hz > task_hz * rate_slack) {
    diagnostics.add(parameters["frames_per_second"].place(),
                    "'frames_per_second' is " + per_second(options.images_hz) +
                        ", above the task's rate of " + per_second(task_hz) +
                        "; a step of the task takes one image: use a faster task");
    return;
  }
  const std::int64_t image_ns = options.images_hz > 0.0 ? std::llround(1e9 / options.images_hz) : step_ns;
  const std::int64_t longest_ns = std::min(image_ns, rtstdb::max_query_window_ns);
  if (options.readout_ns() > longest_ns) {
    const bool rows = options.row_time_ns > 0;
    diagnostics.add(parameters[rows ? "row_time" : "exposure_time"].place(),
                    "an image takes " + config::format_duration(options.readout_ns()) +
                        " from the begin of its first row's exposure to the end of its last one's; at "
                        "most " +
                        config::format_duration(longest_ns) +
                        " are possible, the time to the next image or one second: use a shorter "
                        "'row_time' or 'exposure_time', or a slower rate");
  }
}

void check_shadows(const config::Value& parameters, const CameraOptions& options,
                   config::Diagnostics& diagnostics) {
  if (options.shadows != rtstdb::Shadows::mapped) return;
  if (!options.is_real_time()) {
    diagnostics.add(parameters["shadows"].place(),
                    "'shadows: mapped' needs 'mode: real_time'; light paths find shadows by rays");
  } else if (options.row_time_ns > 0) {
    diagnostics.add(
        parameters["shadows"].place(),
        "'shadows: mapped' needs a 'row_time' of 0: a map has the shadows of one instant, and each "
        "row has another one; use 'shadows: traced'");
  }
}

/// Refuses parameters that the others leave without effect. Those of colours have an effect with
/// 'images: none' too: `hil history` makes images of the camera.
void check_effects(const config::Value& parameters, const CameraOptions& options,
                   config::Diagnostics& diagnostics) {
  const auto refuse_if = [&](bool has_no_effect, const char* key, const char* why) {
    if (has_no_effect && parameters.has(key))
      diagnostics.add(parameters[key].place(), "'" + std::string(key) + "' " + why + " has no effect");
  };
  refuse_if(options.objects == 0, "object_layers", "without 'objects'");
  for (const char* key : {"emitter_points", "lobe_rays"})
    refuse_if(!options.is_real_time(), key, "without 'mode: real_time'");
  refuse_if(options.is_real_time() && options.bounces < 2, "lobe_rays", "with fewer than 2 'bounces'");
}

config::Schema noise_schema() {
  using config::Field;
  using config::Schema;
  return Schema::record(
      {Field::needed("full_well", Schema::number(1.0, 1e9),
                     "Electrons of a channel that is white. Their number is random (shot noise)."),
       Field::with_default("read_noise", Schema::number(0.0, 1e6), "0",
                           "The standard deviation, in electrons, with which a channel is read.")});
}

}  // namespace

std::optional<CameraOptions> read_camera_options(const config::Value& parameters, std::int64_t step_ns,
                                                 config::Diagnostics& diagnostics) {
  const std::size_t mistakes = diagnostics.count();
  CameraOptions options;
  if (parameters.has("carrier")) options.carrier = parameters["carrier"].text();
  options.mount_m = vector_of(parameters["mount"]);
  const auto [w, x, y, z] = config::read_rotation(parameters["rotation"], diagnostics);
  options.rotation = {w, x, y, z};
  options.width = static_cast<std::uint32_t>(parameters["resolution"].items()[0].integer());
  options.height = static_cast<std::uint32_t>(parameters["resolution"].items()[1].integer());
  options.field_of_view_rad = parameters["field_of_view"].number();
  options.near_m = parameters["near"].number();
  if (parameters.has("frames_per_second")) options.images_hz = parameters["frames_per_second"].number();
  options.row_time_ns = parameters["row_time"].duration_ns();
  options.exposure_ns = parameters["exposure_time"].duration_ns();
  options.sensor.exposure_value = parameters["exposure_value"].number();
  if (parameters["mode"].text() == "real_time") options.mode = rtstdb::ImageMode::real_time;
  if (parameters["shadows"].text() == "mapped") options.shadows = rtstdb::Shadows::mapped;
  if (parameters.has("emitter_points"))
    options.emitter_points = static_cast<std::uint32_t>(parameters["emitter_points"].integer());
  if (parameters.has("lobe_rays"))
    options.lobe_rays = static_cast<std::uint32_t>(parameters["lobe_rays"].integer());
  options.samples = parameters.has("samples") ? static_cast<std::uint32_t>(parameters["samples"].integer())
                    : options.is_real_time()  ? 1
                                              : 16;
  options.bounces = static_cast<std::uint32_t>(parameters["bounces"].integer());
  if (parameters.has("seed")) options.seed = parameters["seed"].integer();
  if (parameters.has("noise")) {
    options.sensor.full_well_e = parameters["noise"]["full_well"].number();
    options.sensor.read_noise_e = parameters["noise"]["read_noise"].number();
  }
  options.layers = words(parameters, "layers");
  options.object_layers = words(parameters, "object_layers");
  options.has_images = parameters["images"].text() == "png";
  if (parameters.has("depth_files")) options.depth_step_m = parameters["depth_files"]["step"].number();
  options.max_bytes = static_cast<std::uint64_t>(parameters["max_size"].number());
  options.objects = static_cast<std::uint32_t>(parameters["objects"].integer());
  if (parameters["late"].text() == "partial") options.late = rtstdb::LatePolicy::partial;
  if (!options.has_images && options.depth_step_m == 0.0 && options.objects == 0) {
    diagnostics.add(parameters.place(),
                    "the camera has no output; it needs 'images: png', 'depth_files' or 'objects'");
  }
  check_effects(parameters, options, diagnostics);
  check_size(parameters, options, diagnostics);
  check_times(parameters, options, step_ns, diagnostics);
  check_shadows(parameters, options, diagnostics);
  if (diagnostics.count() > mistakes) return std::nullopt;
  return options;
}

config::Schema camera_schema() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  constexpr double degree = std::numbers::pi / 180.0;
  const auto layers = Schema::list(Schema::text(), 1, 32);
  return Schema::record({
      Field::optional("carrier", Schema::text(),
                      "The body that carries the camera, as 'module.vehicle'. Left out: none; the camera "
                      "stands still in the world."),
      Field::with_default("mount", Schema::list(Schema::quantity(Quantity::length_m, -1e4, 1e4), 3, 3),
                          "[0 m, 0 m, 0 m]",
                          "Position of the camera in the carrier's frame, or in the world."),
      Field::with_default("rotation", config::rotation_schema(), "{}",
                          "Its rotation in that frame. Left out: none, it looks along x, with z up."),
      Field::with_default("resolution", Schema::list(Schema::integer(1, rtstdb::max_image_side), 2, 2),
                          "[640, 480]", "Pixels in a row, and rows. Pixels are square."),
      Field::with_default("field_of_view",
                          Schema::quantity(Quantity::angle_rad, 0.01 * degree, 179.0 * degree), "60 deg",
                          "Horizontal field of view."),
      Field::with_default("near", Schema::quantity(Quantity::length_m, 1e-3, 1e3), "1 cm",
                          "Surfaces at a smaller depth are not seen."),
      Field::optional("frames_per_second", Schema::quantity(Quantity::frequency_hz, 1e-3, 1e5),
                      "Images per second; each is taken at the nearest release of the task. Left out: an "
                      "image at each release."),
      Field::with_default("row_time", Schema::quantity(Quantity::duration_s, 0.0, 1.0), "0 s",
                          "From the begin of a row's exposure to that of the next row, from the top. 0: all "
                          "rows are exposed at the same time."),
      Field::with_default("exposure_time", Schema::quantity(Quantity::duration_s, 0.0, 1.0), "0 s",
                          "How long a row is exposed, from the release on. Colours are averaged over it."),
      Field::with_default("exposure_value", Schema::number(-20.0, 30.0), "12",
                          "Exposure value at ISO 100: the luminance 1.2 cd/m2 * 2^exposure_value is white. A "
                          "sunny day is 15, a lit room 6."),
      Field::with_default("mode", Schema::one_of({"path_traced", "real_time"}), "path_traced",
                          "How colours are made: by light paths, which are right but noisy, or in far less "
                          "time without noise, by the light of lamps, sun and sky and some rays."),
      Field::with_default("shadows", Schema::one_of({"traced", "mapped"}), "traced",
                          "With mode real_time: shadows by rays, or by shadow maps, which take less time "
                          "where lights are many. Maps need a 'row_time' of 0."),
      Field::optional(
          "emitter_points", Schema::integer(1, rtstdb::max_emitter_points),
          "With mode real_time: zones of the surface of each body that emits light, each with a "
          "shadow. Surfaces nearer to its middle than two of its diameters need 64, and a body with "
          "more flat sides as many as sides. Left out: 16."),
      Field::optional("lobe_rays", Schema::integer(1, rtstdb::max_lobe_rays),
                      "With mode real_time and at least 2 bounces: rays from the first surface into what "
                      "its matt part reflects, and as many into what its rough mirror does. Left out: 16."),
      Field::optional("samples", Schema::integer(1, rtstdb::max_image_samples),
                      "Light paths of a pixel; the noise of the colours falls with their root. With mode "
                      "real_time points of a pixel: more than 1 smooth edges and show motion during the "
                      "exposure. Left out: 16, or 1 with mode real_time."),
      Field::with_default("bounces", Schema::integer(0, rtstdb::max_image_bounces), "2",
                          "Reflections before light reaches the camera."),
      Field::optional("seed", Schema::integer(0, 0xFFFFFFFF),
                      "Of the random numbers of light paths and noise. Left out: it follows from the run's "
                      "seed and the module's name."),
      Field::optional("noise", noise_schema(), "The noise of the sensor. Left out: none."),
      Field::optional("layers", layers, "Layers whose bodies and lights the image shows. Left out: all."),
      Field::optional("object_layers", layers, "Layers whose bodies go into the object list. Left out: all."),
      Field::with_default("images", Schema::one_of({"png", "none"}), "png",
                          "Whether the run writes images, as PNG files with 8 bits of sRGB."),
      Field::optional(
          "depth_files",
          Schema::record({Field::with_default("step", Schema::quantity(Quantity::length_m, 1e-5, 10.0),
                                              "1 mm", "The depth that one unit of a file stands for.")}),
          "The run writes depths as PNG files with 16 bits: the depth along the view direction in units of "
          "'step'; 0 is nothing, 65535 that depth or more. Left out: none."),
      Field::with_default("max_size", Schema::quantity(Quantity::data_bytes, 0x1p20, 0x1p40), "1 GiB",
                          "No further file is written once the files of the camera have this size."),
      Field::with_default("objects", Schema::integer(0, 64), "0",
                          "Slots of the object list, the nearest bodies first. 0: no such outputs."),
      Field::with_default("late", Schema::one_of({"finish", "partial"}), "finish",
                          "What happens under 'clock: realtime' to an image that is not done by the task's "
                          "deadline: it is finished late, or it ends there and lacks tiles."),
  });
}

}  // namespace hil::modules
