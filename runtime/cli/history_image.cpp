#include "runtime/cli/history_image.hpp"

#include <glm/geometric.hpp>

#include <cstdio>
#include <filesystem>

#include "runtime/cli/history_options.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/history/history_error.hpp"
#include "runtime/modules/camera/image_encoder.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/run/png_file.hpp"

namespace hil::cli {
namespace {

constexpr const char* path_traced_word = "path_traced";

glm::dvec3 point(const std::vector<double>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

struct Range {
  double lowest = 0.0, highest = 0.0;
};

void check_range(const char* option, double value, const Range& range, const char* unit) {
  if (value >= range.lowest && value <= range.highest) return;
  refuse(report::to_ascii(std::string(option) + ": " + report::shortest(value) + unit + " is out of range; " +
                          report::shortest(range.lowest) + " to " + report::shortest(range.highest) + unit +
                          " are possible"));
}

std::uint32_t whole(const char* option, double value, const Range& range) {
  check_range(option, value, range, "");
  if (value != std::floor(value))
    refuse(std::string(option) + ": " + report::shortest(value) + " is not whole");
  return static_cast<std::uint32_t>(value);
}

/// The camera that stands where the options say.
modules::RecordedCamera free_camera(const ImageArguments& arguments, const std::string& carrier,
                                    const history::RunHistory& history) {
  if (arguments.look_at.empty()) refuse("--position needs --look-at, the point that the camera looks at");
  check_numbers("--position", arguments.position);
  check_numbers("--look-at", arguments.look_at);
  for (const std::vector<double>* numbers : {&arguments.position, &arguments.look_at})
    for (const double number : *numbers)
      check_range(numbers == &arguments.position ? "--position" : "--look-at", number,
                  {-rtstdb::max_coordinate_m, rtstdb::max_coordinate_m}, " m");
  const glm::dvec3 from = point(arguments.position), to = point(arguments.look_at);
  if (glm::distance(from, to) < 1e-3) refuse("--look-at is --position, so the camera has no direction");
  modules::RecordedCamera camera = modules::camera_looking_at(from, to);
  camera.samples = config::default_view_samples(false);
  camera.name = "camera";
  if (carrier.empty()) return camera;
  const rtstdb::EntityId entity = history.find(carrier);
  camera.carrier_index = entity.index;
  camera.carrier_generation = entity.generation;
  return camera;
}

void check_file(const char* option, const std::string& file, const std::string& directory) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  if (extension != ".png")
    refuse(std::string(option) + " " + file + ": the name of a PNG file ends with .png");
  check_outside(option, file, directory);
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
  if (arguments.depth_step.empty()) return 1e-3;
  const double step_m = read_distance_m("--depth-step", arguments.depth_step);
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

void check_image_files(const ImageArguments& arguments, const std::string& directory) {
  check_file("--file", arguments.file, directory);
  if (arguments.depth_file.empty()) {
    if (!arguments.depth_step.empty()) refuse("--depth-step needs --depth-file");
    return;
  }
  check_file("--depth-file", arguments.depth_file, directory);
  std::error_code error;
  if (std::filesystem::weakly_canonical(arguments.depth_file, error) ==
      std::filesystem::weakly_canonical(arguments.file, error))
    refuse("--file and --depth-file are the same file");
  depth_step_m(arguments);
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
    camera.width = whole("--size", arguments.size[0], {1, rtstdb::max_image_side});
    camera.height = whole("--size", arguments.size[1], {1, rtstdb::max_image_side});
  }
  if (!arguments.field_of_view.empty()) {
    camera.field_of_view_rad =
        read_option("--field-of-view", arguments.field_of_view, config::Quantity::angle_rad).value_si;
    constexpr double degree = std::numbers::pi / 180.0;
    check_range("--field-of-view", camera.field_of_view_rad / degree, {0.01, 179.0}, " deg");
  }
  if (!arguments.mode.empty() && camera.is_real_time == (arguments.mode == path_traced_word)) {
    camera.is_real_time = !camera.is_real_time;
    camera.has_mapped_shadows = false;
    camera.samples = config::default_view_samples(!camera.is_real_time);
  }
  if (arguments.samples)
    camera.samples = whole("--samples", *arguments.samples, {1, rtstdb::max_image_samples});
  if (arguments.bounces)
    camera.bounces = whole("--bounces", *arguments.bounces, {0, rtstdb::max_image_bounces});
  if (arguments.exposure_value) {
    check_range("--exposure-value", *arguments.exposure_value, {-20.0, 30.0}, "");
    camera.exposure_value = *arguments.exposure_value;
    camera.has_automatic_exposure = false;
  }
  if (!layers.empty()) camera.mask = history.mask_of(layers);
  return camera;
}

ImageFileNames image_file_names(const ImageArguments& arguments, std::size_t index, bool is_series) {
  if (!is_series) return {arguments.file, arguments.depth_file};
  return {numbered(arguments.file, index),
          arguments.depth_file.empty() ? std::string() : numbered(arguments.depth_file, index)};
}

void write_image(const modules::StillImage& image, const ImageArguments& arguments,
                 const ImageFileNames& files) {
  write_file({.width = image.width, .height = image.height, .pixels = run::PngImage::Rgb8{image.rgb}},
             files.color);
  if (files.depth.empty()) return;
  const std::vector<std::uint16_t> depths = modules::depth_samples(image.depth_m, depth_step_m(arguments));
  write_file({.width = image.width, .height = image.height, .pixels = run::PngImage::Grey16{depths}},
             files.depth);
}

}  // namespace hil::cli
