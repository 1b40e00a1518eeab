#include "runtime/cli/history_image.hpp"

#include <glm/geometric.hpp>

#include <cstdio>
#include <filesystem>

#include "runtime/cli/history_options.hpp"
#include "runtime/history/history_error.hpp"
#include "runtime/run/image_files.hpp"
#include "runtime/run/png_file.hpp"

namespace hil::cli {
namespace {

constexpr const char* path_traced_word = "path_traced";

glm::dvec3 point(const std::vector<double>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

/// The camera that stands where the options say.
modules::RecordedCamera free_camera(const ImageArguments& arguments, const std::string& carrier,
                                    const history::RunHistory& history) {
  if (arguments.look_at.empty()) refuse("--position needs --look-at, the point that the camera looks at");
  check_numbers("--position", arguments.position);
  check_numbers("--look-at", arguments.look_at);
  const glm::dvec3 from = point(arguments.position), to = point(arguments.look_at);
  if (glm::distance(from, to) < 1e-3) refuse("--look-at is --position, so the camera has no direction");
  modules::RecordedCamera camera = modules::camera_looking_at(from, to);
  camera.name = "camera";
  if (carrier.empty()) return camera;
  const rtstdb::EntityId entity = history.find(carrier);
  camera.carrier_index = entity.index;
  camera.carrier_generation = entity.generation;
  return camera;
}

std::string numbered(const std::string& file, std::size_t index) {
  const std::filesystem::path path(file);
  char number[16];
  std::snprintf(number, sizeof number, "-%04zu", index);
  return (path.parent_path() / (path.stem().string() + number + path.extension().string())).string();
}

void write_file(const run::PngImage& image, const std::string& file) {
  if (const std::string fault = run::write_png(image, file); !fault.empty())
    throw history::HistoryError(history::HistoryError::Kind::file, fault);
}

double depth_step_m(const ImageArguments& arguments) {
  const double step_m = distance_m("--depth-step", arguments.depth_step);
  if (step_m < 1e-5 || step_m > 10.0)
    refuse("--depth-step " + arguments.depth_step + ": 0.01 mm to 10 m are possible");
  return step_m;
}

}  // namespace

void add_image_options(CLI::App* command, ImageArguments& a) {
  const auto numbers = [&](const char* name, std::vector<double>& into, const char* about) {
    command->add_option(name, into, about)->delimiter(',')->expected(3);
  };
  command->add_option("--camera", a.camera, "a camera of the run: a module or one of world.views");
  numbers("--position", a.position, "instead: a camera at x,y,z in m");
  numbers("--look-at", a.look_at, "the point that it looks at: x,y,z in m");
  command->add_option("--size", a.size, "pixels in a row, and rows: 640,480")->delimiter(',')->expected(2);
  command->add_option("--field-of-view", a.field_of_view, "horizontal field of view: 60deg");
  command->add_option("--mode", a.mode, "how colours are made")
      ->check(CLI::IsMember({"real_time", path_traced_word}));
  command->add_option("--samples", a.samples, "points or light paths of a pixel");
  command->add_option("--bounces", a.bounces, "reflections before light reaches the camera");
  command->add_option("--exposure-value", a.exposure_value, "at ISO 100: 15 on a sunny day, 6 in a room");
  command->add_option("--file", a.file, "the PNG file to write")->required();
  command->add_option("--depth-file", a.depth_file, "also write depths: a PNG file with 16 bits");
  command->add_option("--depth-step", a.depth_step, "the depth of one unit of that file (default: 1mm)");
}

modules::RecordedCamera camera_of(const ImageArguments& arguments, const std::string& carrier,
                                  const std::vector<std::string>& layers,
                                  const history::RunHistory& history) {
  if (arguments.camera.empty() == arguments.position.empty()) refuse("give one of --camera and --position");
  const bool is_free = arguments.camera.empty();
  if (!is_free && (!arguments.look_at.empty() || !carrier.empty()))
    refuse("--look-at and --carried-by are for --position; a camera of the run has its own");
  modules::RecordedCamera camera =
      is_free ? free_camera(arguments, carrier, history) : history.camera(arguments.camera);
  if (!arguments.size.empty()) {
    camera.width = arguments.size[0];
    camera.height = arguments.size[1];
  }
  if (!arguments.field_of_view.empty())
    camera.field_of_view_rad =
        read_option("--field-of-view", arguments.field_of_view, config::Quantity::angle_rad).value_si;
  if (!arguments.mode.empty() && camera.is_real_time == (arguments.mode == path_traced_word)) {
    camera.is_real_time = !camera.is_real_time;
    camera.has_shadow_maps = false;
    camera.samples = camera.is_real_time ? 4 : 64;
  }
  camera.samples = arguments.samples.value_or(camera.samples);
  camera.bounces = arguments.bounces.value_or(camera.bounces);
  if (arguments.exposure_value) {
    camera.exposure_value = *arguments.exposure_value;
    camera.has_automatic_exposure = false;
  }
  if (!layers.empty()) camera.mask = history.mask_of(layers);
  depth_step_m(arguments);  // refused before the image is made
  return camera;
}

ImageFiles image_files(const ImageArguments& arguments, std::size_t index, bool is_series) {
  if (!is_series) return {arguments.file, arguments.depth_file};
  return {numbered(arguments.file, index),
          arguments.depth_file.empty() ? std::string() : numbered(arguments.depth_file, index)};
}

void write(const modules::StillImage& image, const ImageArguments& arguments, const ImageFiles& files) {
  write_file({.width = image.width, .height = image.height, .pixels = run::PngImage::Rgb8{image.rgb}},
             files.color);
  if (files.depth.empty()) return;
  const std::vector<std::uint16_t> depths = run::depth_samples(image.depth_m, depth_step_m(arguments));
  write_file({.width = image.width, .height = image.height, .pixels = run::PngImage::Grey16{depths}},
             files.depth);
}

}  // namespace hil::cli
