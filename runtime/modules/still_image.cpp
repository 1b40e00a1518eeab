#include "runtime/modules/still_image.hpp"

#include <glm/gtc/packing.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <span>
#include <thread>
#include <utility>

namespace hil::modules {
namespace {

/// A hazy day, with the sun in the south, 30 degrees towards the west and 45 degrees high.
std::vector<rtstdb::FixedLight> daylight() {
  constexpr double degree = std::numbers::pi / 180.0;
  const glm::dquat azimuth = glm::angleAxis(60.0 * degree, glm::dvec3(0.0, 0.0, 1.0));
  const glm::dquat elevation = glm::angleAxis(45.0 * degree, glm::dvec3(0.0, 1.0, 0.0));
  const rtstdb::Light sun{.kind = rtstdb::LightKind::directional,
                          .color = {1.0, 0.96, 0.9},
                          .illuminance_lx = 30000.0,
                          .angular_diameter_rad = 0.53 * degree};
  const rtstdb::Light sky{.kind = rtstdb::LightKind::sky,
                          .zenith_cdpm2 = {4000.0, 5200.0, 8000.0},
                          .horizon_cdpm2 = {9000.0, 9600.0, 10500.0},
                          .ground_cdpm2 = {5000.0, 5000.0, 5000.0}};
  return {{.light = sun, .q_world = glm::quat(azimuth * elevation)}, {.light = sky}};
}

/// Whether the camera's mask has a light or a surface that emits light.
rtstdb::Result<bool> has_light(const rtstdb::Database& database, const rtstdb::ReadAt& read_at,
                               std::uint32_t mask) {
  const auto states = database.snapshot(read_at);
  if (!states) return states.error();
  return std::ranges::any_of(states.value(), [&](const rtstdb::EntityState& state) {
    if ((state.row.mask & mask) == 0) return false;
    if (state.row.light.valid()) return true;
    return state.row.geometry.valid() &&
           database.material(state.row.material).value_or(rtstdb::Material{}).emission_cdpm2 !=
               glm::dvec3(0.0);
  });
}

double automatic_exposure_value(std::span<const rtstdb::HalfColor> color, double without_light) {
  constexpr double middle_grey = 0.25;
  double sum = 0.0;
  std::size_t count = 0;
  for (const rtstdb::HalfColor& pixel : color) {
    const double luminance = 0.2126 * static_cast<double>(glm::unpackHalf1x16(pixel[0])) +
                             0.7152 * static_cast<double>(glm::unpackHalf1x16(pixel[1])) +
                             0.0722 * static_cast<double>(glm::unpackHalf1x16(pixel[2]));
    if (!(luminance > 0.0)) continue;
    sum += std::log2(luminance);
    ++count;
  }
  if (count == 0) return without_light;
  return sum / static_cast<double>(count) - std::log2(middle_grey * rtstdb::white_cdpm2(0.0));
}

/// The pixels of a running camera are sRGB already unless it has noise.
std::vector<std::uint8_t> rgb_of(const rtstdb::Image& image, const RecordedCamera& camera,
                                 std::int64_t time_ns) {
  std::vector<rtstdb::SrgbColor> srgb(image.srgb.begin(), image.srgb.end());
  if (srgb.empty()) {
    srgb.resize(image.color.size());
    ImageSensor(sensor_of(camera)).develop(image.color, time_ns, srgb);
  }
  std::vector<std::uint8_t> rgb;
  rgb.reserve(3 * srgb.size());
  for (const rtstdb::SrgbColor& pixel : srgb)
    rgb.insert(rgb.end(), pixel.begin(), pixel.begin() + 3);
  return rgb;
}

StillImage still_of(const rtstdb::Image& image, const RecordedCamera& camera, std::int64_t time_ns) {
  VisibleBodies bodies;
  bodies.find(image.width, image.entities, image.depth_m);
  const auto nearest = bodies.nearest_first();
  return {.width = image.width,
          .height = image.height,
          .rgb = rgb_of(image, camera, time_ns),
          .depth_m = {image.depth_m.begin(), image.depth_m.end()},
          .bodies = {nearest.begin(), nearest.end()},
          .ignored_pixels = bodies.ignored_pixels(),
          .exposure_value = camera.exposure_value,
          .is_in_daylight = false,
          .incomplete_pixels = image.incomplete_pixels,
          .lights_overflow = image.lights_overflow};
}

/// Executes the transaction, and cancels it when `stop` becomes true.
const rtstdb::Outcome& execute_until(rtstdb::Database& database, rtstdb::Transaction& transaction,
                                     const std::atomic<bool>* stop) {
  if (stop == nullptr) return database.execute(transaction);
  database.submit(transaction);
  while (transaction.status() == rtstdb::Status::pending) {
    if (stop->load()) database.cancel(transaction);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return database.wait(transaction);
}

}  // namespace

rtstdb::Result<StillImage> take_still_image(rtstdb::Database& database, RecordedCamera camera,
                                            const rtstdb::ReadAt& read_at, std::int64_t time_ns,
                                            const std::atomic<bool>* stop) {
  const bool is_linear = camera.has_automatic_exposure || camera.full_well_e > 0.0;
  rtstdb::ImageQueryOptions options =
      image_options_of(camera, {.color = is_linear, .srgb = !is_linear, .depth = true, .identity = true});
  const auto lit = has_light(database, read_at, camera.mask);
  if (!lit) return lit.error();
  if (camera.has_daylight && !lit.value()) options.fixed_lights = daylight();
  const auto query = database.prepare(options);
  if (!query) return query.error();
  query.value()->cameras()[0] = camera_at(camera, time_ns);
  const auto transaction = database.make_transaction({.max_queries = 1});
  transaction->begin({.read_at = read_at});
  transaction->add_query(*query.value(), 1);
  const rtstdb::Outcome& outcome = execute_until(database, *transaction, stop);
  if (!outcome.done()) {
    const bool is_lost = outcome.status == rtstdb::Status::device_lost;
    return rtstdb::Error{is_lost ? rtstdb::ErrorCode::device_lost : rtstdb::ErrorCode::bad_input,
                         rtstdb::describe(outcome)};
  }
  const rtstdb::Image& image = std::as_const(*query.value()).images()[0];
  if (camera.has_automatic_exposure)
    camera.exposure_value = automatic_exposure_value(image.color, camera.exposure_value);
  StillImage still = still_of(image, camera, time_ns);
  still.is_in_daylight = !options.fixed_lights.empty();
  still.is_dark = !lit.value() && !still.is_in_daylight;
  return still;
}

}  // namespace hil::modules
