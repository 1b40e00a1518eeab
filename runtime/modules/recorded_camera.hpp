#pragma once
// A camera as a history needs it to take its images again: a module of type camera and a view of the
// scenario write it into world.json, in the list "cameras". The images of a running camera come from the same
// description, so an image of a history is the one that the run took, bit for bit.
//
// Units: metres, radians, nanoseconds. Frame: the carrier's, or without a carrier the world's. The camera
// looks along its x axis, with z up. Threads: plain data and pure functions.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstdint>
#include <string>

#include <rtstdb/image.hpp>

#include "runtime/contribution/world_record.hpp"
#include "runtime/modules/camera/image_sensor.hpp"

namespace hil::modules {

/// The key of world.json whose list holds the cameras.
inline constexpr const char* camera_list = "cameras";

struct RecordedCamera {
  std::string name;  ///< of the module or the view
  std::uint32_t carrier_index = rtstdb::EntityId{}.index, carrier_generation = 0;  ///< by default none
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};  ///< camera to carrier or world
  std::uint32_t width = 640, height = 480;
  double field_of_view_rad = 1.0;  ///< horizontal
  double near_m = 0.01;
  std::int64_t row_time_ns = 0, exposure_ns = 0;
  bool is_real_time = false, has_mapped_shadows = false;
  std::uint32_t samples = 16, bounces = 2;
  std::uint32_t emitter_points = 16, lobe_rays = 16;  ///< of real-time mode
  std::uint32_t mask = rtstdb::mask_all;
  std::int64_t seed = 0;  ///< of light paths and noise
  double exposure_value = 12.0;
  bool has_automatic_exposure = false;  ///< instead of exposure_value (still_image.hpp)
  bool has_daylight = false;            ///< where the camera sees no light (still_image.hpp)
  double full_well_e = 0.0, read_noise_e = 0.0;

  rtstdb::EntityId carrier() const noexcept { return {carrier_index, carrier_generation}; }

  template <class Self, class Visit>
  static void each_property(Self& self, Visit&& visit) {
    visit("carrier_index", self.carrier_index);
    visit("carrier_generation", self.carrier_generation);
    visit("position_m", self.position_m);
    visit("rotation_wxyz", self.rotation_wxyz);
    visit("width", self.width);
    visit("height", self.height);
    visit("field_of_view_rad", self.field_of_view_rad);
    visit("near_m", self.near_m);
    visit("row_time_ns", self.row_time_ns);
    visit("exposure_ns", self.exposure_ns);
    visit("real_time", self.is_real_time);
    visit("mapped_shadows", self.has_mapped_shadows);
    visit("samples", self.samples);
    visit("bounces", self.bounces);
    visit("emitter_points", self.emitter_points);
    visit("lobe_rays", self.lobe_rays);
    visit("mask", self.mask);
    visit("seed", self.seed);
    visit("exposure_value", self.exposure_value);
    visit("automatic_exposure", self.has_automatic_exposure);
    visit("daylight", self.has_daylight);
    visit("full_well_e", self.full_well_e);
    visit("read_noise_e", self.read_noise_e);
  }
};

contribution::ModuleRecord to_module_record(const RecordedCamera& camera);
/// Throws RecordError with the name of the property. What an image query refuses is not checked.
RecordedCamera to_recorded_camera(const contribution::ModuleRecord& record);

/// A camera that looks from one point to another, and what a picture for a reader needs: automatic exposure,
/// daylight, and real-time mode. Misuse: both points are the same.
RecordedCamera camera_looking_at(const glm::dvec3& position_m, const glm::dvec3& target_m);

/// The options of a query for images of this camera.
rtstdb::ImageQueryOptions image_options_of(const RecordedCamera& camera, const rtstdb::ImageOutputs& outputs);
/// The camera of the image whose exposure begins at this run time.
rtstdb::Camera camera_at(const RecordedCamera& camera, std::int64_t time_ns) noexcept;
SensorOptions sensor_of(const RecordedCamera& camera) noexcept;

}  // namespace hil::modules
