#include "runtime/modules/recorded_camera.hpp"

#include <glm/ext/quaternion_float.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>

#include <hil/record.hpp>
#include <hil/splitmix64.hpp>

namespace hil::modules {

contribution::ModuleRecord to_module_record(const RecordedCamera& camera) {
  return properties_of(camera, camera_list, camera.name);
}

RecordedCamera to_recorded_camera(const contribution::ModuleRecord& record) {
  auto camera = record_of<RecordedCamera>(record, "camera");
  camera.name = record.name;
  return camera;
}

RecordedCamera camera_looking_at(const glm::dvec3& position_m, const glm::dvec3& target_m) {
  const glm::dvec3 to = target_m - position_m;
  const double yaw_rad = std::atan2(to.y, to.x);
  const double pitch_rad = std::atan2(-to.z, std::hypot(to.x, to.y));  // positive: down
  const glm::dquat q = glm::angleAxis(yaw_rad, glm::dvec3(0.0, 0.0, 1.0)) *
                       glm::angleAxis(pitch_rad, glm::dvec3(0.0, 1.0, 0.0));
  RecordedCamera camera;
  camera.position_m = {position_m.x, position_m.y, position_m.z};
  camera.rotation_wxyz = {q.w, q.x, q.y, q.z};
  camera.is_real_time = true;
  camera.bounces = 1;
  camera.has_automatic_exposure = true;
  camera.has_daylight = true;
  return camera;
}

rtstdb::ImageQueryOptions image_options_of(const RecordedCamera& camera,
                                           const rtstdb::ImageOutputs& outputs) {
  const bool can_be_drawn = camera.is_real_time && camera.row_time_ns == 0;
  return {.name = camera.name,
          .capacity = 1,
          .width = camera.width,
          .height = camera.height,
          .mode = camera.is_real_time ? rtstdb::ImageMode::real_time : rtstdb::ImageMode::path_traced,
          .outputs = outputs,
          .first_hits = can_be_drawn ? rtstdb::FirstHits::rasterised : rtstdb::FirstHits::traced,
          .samples_per_pixel = camera.samples,
          .bounces = camera.bounces,
          .shadows = camera.has_mapped_shadows ? rtstdb::Shadows::mapped : rtstdb::Shadows::traced,
          .emitter_points = camera.emitter_points,
          .lobe_rays = camera.lobe_rays};
}

rtstdb::Camera camera_at(const RecordedCamera& camera, std::int64_t time_ns) noexcept {
  const std::uint64_t number = splitmix64(static_cast<std::uint64_t>(time_ns));
  const auto& [x, y, z] = camera.position_m;
  const auto& [qw, qx, qy, qz] = camera.rotation_wxyz;
  return {.p_m = glm::vec3(glm::dvec3(x, y, z)),
          .q = glm::quat(glm::dquat(qw, qx, qy, qz)),
          .horizontal_angle_rad = static_cast<float>(camera.field_of_view_rad),
          .near_m = static_cast<float>(camera.near_m),
          .t = rtstdb::world_time_ns(time_ns),
          .row_time = rtstdb::Nanoseconds(camera.row_time_ns),
          .exposure = rtstdb::Nanoseconds(camera.exposure_ns),
          .exposure_value = static_cast<float>(camera.exposure_value),
          .mask = camera.mask,
          .carrier = camera.carrier(),
          .seed = static_cast<std::uint32_t>(
              splitmix64_finalizer(static_cast<std::uint64_t>(camera.seed) ^ number))};
}

SensorOptions sensor_of(const RecordedCamera& camera) noexcept {
  return {.exposure_value = camera.exposure_value,
          .full_well_e = camera.full_well_e,
          .read_noise_e = camera.read_noise_e,
          .noise_seed = static_cast<std::uint64_t>(camera.seed)};
}

}  // namespace hil::modules
