// A camera's record is written to world.json and read back; a damaged record is refused with the name of its
// property. Where a camera looks.

#include "runtime/modules/recorded_camera.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>

#include <hil/record.hpp>

namespace hil::modules {
namespace {

const RecordedCamera front{.name = "front",
                           .carrier_index = 11,
                           .carrier_generation = 3,
                           .position_m = {1.5, -0.1, 0.85},
                           .rotation_wxyz = {0.8, 0.6, 0.0, 0.0},
                           .width = 320,
                           .height = 200,
                           .field_of_view_rad = 1.25,
                           .near_m = 0.25,
                           .row_time_ns = 20'000,
                           .exposure_ns = 5'000'000,
                           .is_real_time = true,
                           .has_mapped_shadows = true,
                           .samples = 3,
                           .bounces = 7,
                           .emitter_points = 9,
                           .lobe_rays = 5,
                           .mask = 0x8000'0001U,
                           .seed = 0x1234'5678'9ABC'DEF0,
                           .exposure_value = 9.5,
                           .has_automatic_exposure = true,
                           .has_daylight = true,
                           .full_well_e = 2000.0,
                           .read_noise_e = 8.0};

std::string refusal_of_camera(const contribution::ModuleRecord& record) {
  try {
    to_recorded_camera(record);
  } catch (const RecordError& error) {
    return error.what();
  }
  return {};
}

TEST(RecordedCamera, IsReadBackAsWritten) {
  const contribution::ModuleRecord record = to_module_record(front);
  EXPECT_EQ(record.list, "cameras");
  const RecordedCamera read = to_recorded_camera(record);
  EXPECT_EQ(read.name, "front");
  EXPECT_EQ(read.carrier(), (rtstdb::EntityId{11, 3}));
  const contribution::ModuleRecord again = to_module_record(read);
  ASSERT_EQ(again.properties.size(), record.properties.size());
  for (std::size_t i = 0; i < record.properties.size(); ++i)
    EXPECT_EQ(again.properties[i].value, record.properties[i].value) << record.properties[i].key;
  // Every property differs from that of another camera, so each is written.
  const contribution::ModuleRecord other = to_module_record(RecordedCamera{});
  for (std::size_t i = 0; i < record.properties.size(); ++i)
    EXPECT_NE(other.properties[i].value, record.properties[i].value) << record.properties[i].key;
  EXPECT_FALSE(to_recorded_camera(other).carrier().valid());
}

TEST(RecordedCamera, DamageIsRefusedWithTheProperty) {
  contribution::ModuleRecord record = to_module_record(front);
  const auto width = std::ranges::find(record.properties, "width", &contribution::Property::key);
  width->value = 320.5;
  EXPECT_EQ(refusal_of_camera(record),
            "world.json: camera 'front': property 'width' has a value of another type or range");
  record.properties.erase(width);
  EXPECT_EQ(refusal_of_camera(record), "world.json: camera 'front': property 'width' is missing");
}

TEST(RecordedCamera, LooksAtItsTargetWithZUp) {
  const glm::dvec3 from(1.0, 2.0, 3.0);
  for (const glm::dvec3& to :
       {glm::dvec3(5.0, 2.0, 3.0), glm::dvec3(-4.0, -7.0, 1.0), glm::dvec3(1.0, 2.0, 9.0),
        glm::dvec3(1.0, 2.0, -9.0), glm::dvec3(1.0, -2.0, 3.5)}) {
    const RecordedCamera camera = camera_looking_at(from, to);
    const auto& [w, x, y, z] = camera.rotation_wxyz;
    const glm::dquat q(w, x, y, z);
    const glm::dvec3 ahead = q * glm::dvec3(1.0, 0.0, 0.0);
    EXPECT_LT(glm::distance(ahead, glm::normalize(to - from)), 1e-12);
    EXPECT_NEAR((q * glm::dvec3(0.0, 1.0, 0.0)).z, 0.0, 1e-12) << "the horizon is level";
    EXPECT_GE((q * glm::dvec3(0.0, 0.0, 1.0)).z, -1e-12) << "it does not stand on its head";
  }
}

TEST(RecordedCamera, FirstHitsAreDrawnInRealTimeModeUnlessRowsHaveTheirOwnTimes) {
  RecordedCamera camera;
  EXPECT_EQ(image_options_of(camera, {}).first_hits, rtstdb::FirstHits::traced);
  camera.is_real_time = true;
  EXPECT_EQ(image_options_of(camera, {}).first_hits, rtstdb::FirstHits::rasterised);
  camera.row_time_ns = 10'000;
  EXPECT_EQ(image_options_of(camera, {}).first_hits, rtstdb::FirstHits::traced);
}

}  // namespace
}  // namespace hil::modules
