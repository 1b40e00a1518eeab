// The parameters of a camera that are refused, with their places and limits.

#include "runtime/modules/camera/camera_options.hpp"

#include <gtest/gtest.h>

#include "runtime/config/parse.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t step_ns = 10'000'000;

/// The parameters are those of `yaml`, in its second line.
std::optional<CameraOptions> read(const std::string& yaml, config::Diagnostics& diagnostics) {
  const auto parameters =
      config::parse_text("camera.yaml", "carrier: ego\n" + yaml, camera_schema(), diagnostics);
  return parameters ? read_camera_options(*parameters, step_ns, diagnostics) : std::nullopt;
}

TEST(CameraOptions, HaveDefaultsAndUnits) {
  config::Diagnostics none;
  const auto given = read(
      "field_of_view: 90 deg\nrotation: {pitch: 90 deg}\nexposure_time: 2 ms\n"
      "row_time: 10 us\nnoise: {full_well: 9000}\ndepth_files: {}\nlate: partial",
      none);
  ASSERT_TRUE(given) << none.to_text();
  EXPECT_EQ(given->width, 640U);
  EXPECT_EQ(given->height, 480U);
  EXPECT_NEAR(given->field_of_view_rad, 1.5707963, 1e-6);
  EXPECT_EQ(given->readout_ns(), 479 * 10'000 + 2'000'000);
  EXPECT_EQ(given->sensor.full_well_e, 9000.0);
  EXPECT_EQ(given->depth_step_m, 0.001);
  EXPECT_EQ(given->late, rtstdb::LatePolicy::partial);
  EXPECT_TRUE(given->has_images);
  EXPECT_FALSE(given->seed);
  const glm::dvec3 ahead = given->rotation * glm::dvec3(1.0, 0.0, 0.0);
  EXPECT_NEAR(ahead.z, -1.0, 1e-12) << "a positive pitch looks down";
}

TEST(CameraOptions, HaveOtherDefaultsInRealTimeMode) {
  config::Diagnostics diagnostics;
  const auto real_time = read("mode: real_time\nshadows: mapped", diagnostics);
  ASSERT_TRUE(real_time) << diagnostics.to_text();
  EXPECT_EQ(real_time->mode, rtstdb::ImageMode::real_time);
  EXPECT_EQ(real_time->shadows, rtstdb::Shadows::mapped);
  EXPECT_EQ(real_time->samples, 1U);
  EXPECT_EQ(real_time->emitter_points, 16U);
  EXPECT_EQ(real_time->lobe_rays, 16U);
  EXPECT_EQ(read("mode: path_traced", diagnostics)->samples, 16U);
  const auto chosen = read("mode: real_time\nsamples: 4\nemitter_points: 64\nlobe_rays: 32", diagnostics);
  ASSERT_TRUE(chosen) << diagnostics.to_text();
  EXPECT_EQ(chosen->samples, 4U);
  EXPECT_EQ(chosen->emitter_points, 64U);
  EXPECT_EQ(chosen->lobe_rays, 32U);
}

TEST(CameraOptions, OfColoursAreForImagesOfTheHistoryToo) {
  config::Diagnostics diagnostics;
  const auto given = read("images: none\nobjects: 1\nsamples: 64\nnoise: {full_well: 100}", diagnostics);
  ASSERT_TRUE(given) << diagnostics.to_text();
  EXPECT_EQ(given->samples, 64U);
  EXPECT_EQ(given->sensor.full_well_e, 100.0);
}

TEST(CameraOptions, AreRefusedWithTheirValuesAndLimits) {
  const std::pair<const char*, const char*> refused[] = {
      {"resolution: [0, 480]", "16384"},
      {"resolution: [640, 0]", "16384"},
      {"resolution: [16384, 16384]", "'resolution' has 268435456 pixels; at most 16777216 are possible"},
      {"field_of_view: 180 deg", "179 deg"},
      {"field_of_view: 0 deg", "0.01 deg"},
      {"field_of_view: 179 deg\nresolution: [10, 100]", "at most 179.88 deg are possible"},
      {"near: 0 m", "near"},
      {"exposure_value: 31", "30"},
      {"samples: 0", "65536"},
      {"bounces: 65", "64"},
      {"images: none", "the camera has no output"},
      {"exposure_time: 11 ms",
       "an image takes 11 ms from the begin of its first row's exposure to the end of its last one's; at "
       "most "
       "10 ms are possible"},
      {"row_time: 30 us", "an image takes 14.37 ms"},
      {"row_time: 3 ms\nframes_per_second: 0.5 Hz", "at most 1 s are possible"},
      {"object_layers: [a]\nimages: png", "'object_layers' without 'objects' has no effect"},
      {"emitter_points: 64", "'emitter_points' without 'mode: real_time' has no effect"},
      {"lobe_rays: 64", "'lobe_rays' without 'mode: real_time' has no effect"},
      {"lobe_rays: 64\nmode: real_time\nbounces: 1", "'lobe_rays' with fewer than 2 'bounces' has no effect"},
      {"frames_per_second: 101 Hz", "'frames_per_second' is 101 Hz, above the task's rate of 100 Hz"},
      {"noise: {read_noise: 3}", "full_well"},
      {"noise: {full_well: 0}", "1"},
      {"depth_files: {step: 0 m}", "step"},
      {"objects: 65", "64"},
      {"seed: -1", "0"},
      {"rotation: {quaternion: [1, 1, 0, 0]}", "'quaternion' has the length"},
      {"late: last_good", "partial"},
      {"mode: fast", "real_time"},
      {"shadows: mapped", "'shadows: mapped' needs 'mode: real_time'"},
      {"mode: real_time\nshadows: mapped\nrow_time: 10 us", "'shadows: mapped' needs a 'row_time' of 0"},
  };
  for (const auto& [yaml, message] : refused) {
    config::Diagnostics diagnostics;
    EXPECT_FALSE(read(yaml, diagnostics)) << yaml;
    ASSERT_EQ(diagnostics.count(), 1U) << yaml << "\n" << diagnostics.to_text();
    EXPECT_NE(diagnostics.mistakes()[0].message.find(message), std::string::npos)
        << diagnostics.to_text() << "\nlacks: " << message;
    EXPECT_LE(diagnostics.mistakes()[0].place.line, 3U);
  }
}

}  // namespace
}  // namespace hil::modules
