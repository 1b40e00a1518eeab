#pragma once
// The parameters of a camera.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>
#include <rtstdb/image.hpp>

#include "runtime/modules/camera/image_sensor.hpp"

namespace hil::modules {

struct CameraOptions {
  std::string carrier{};                    ///< empty: none, the camera stands still in the world
  glm::dvec3 mount_m{0.0};                  ///< in the carrier's frame or the world's
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  ///< camera to carrier or world
  std::uint32_t width = 0, height = 0;
  double field_of_view_rad = 0.0;  ///< horizontal
  double near_m = 0.0;
  double images_hz = 0.0;  ///< 0: an image in each release
  std::int64_t row_time_ns = 0, exposure_ns = 0;
  rtstdb::ImageMode mode = rtstdb::ImageMode::path_traced;
  rtstdb::Shadows shadows = rtstdb::Shadows::traced;  ///< of real-time mode
  std::uint32_t emitter_points = 16, lobe_rays = 16;  ///< of real-time mode
  std::uint32_t samples = 0, bounces = 0;
  std::optional<std::int64_t> seed{};                  ///< empty: of the run's seed and the module's name
  SensorOptions sensor{};                              ///< without its seed
  std::vector<std::string> layers{}, object_layers{};  ///< empty: all
  bool has_images = false;
  double depth_step_m = 0.0;  ///< 0: no files of depths
  std::uint64_t max_bytes = 0;
  std::uint32_t objects = 0;  ///< slots of the object list
  rtstdb::LatePolicy late = rtstdb::LatePolicy::discard;

  bool is_real_time() const noexcept { return mode == rtstdb::ImageMode::real_time; }
  /// From the first to the last instant of an image.
  std::int64_t readout_ns() const noexcept { return (height - 1) * row_time_ns + exposure_ns; }
};

/// The largest number of pixels of a camera: its buffers take up to 36 bytes for each.
inline constexpr std::uint64_t max_camera_pixels = std::uint64_t{1} << 24;

config::Schema camera_schema();
/// Empty with mistakes, at their places, for parameters that contradict each other or a task with steps of
/// `step_ns`. `parameters` conform to the schema.
std::optional<CameraOptions> read_camera_options(const config::Value& parameters, std::int64_t step_ns,
                                                 config::Diagnostics& diagnostics);

}  // namespace hil::modules
