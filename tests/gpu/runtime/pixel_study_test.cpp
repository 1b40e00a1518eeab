// A small pixel study in a world: beams that cover their pixels find the reflector, few rays do not.

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <string>
#include <vector>

#include "configs/docking/modules/docking.hpp"
#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules {
namespace {

enum Output : std::size_t { progress, finished, tiling_beams_missed, rays_detected_beyond, incomplete };

class PixelStudyModule : public test::ModuleFixture {
 protected:
  PixelStudyModule() : ModuleFixture({"station"}) {}

  /// A wall in the plane x = 0, and a disc of 1 cm in front of it, as seen from +x.
  void SetUp() override {
    ModuleFixture::SetUp();
    rtstdb::EntityRow wall;
    wall.geometry = world_->add_geometry(rtstdb::make_box({0.2, 6.0, 6.0}), "wall");
    wall.motion.p_world_m = {-0.2, 0.0, 0.0};
    world_->create("wall", wall);
    rtstdb::EntityRow disc;
    disc.geometry = world_->add_geometry(rtstdb::make_cylinder(0.005, 0.01), "disc");
    disc.motion.p_world_m = {0.0, 0.31, 0.22};
    disc.motion.q_world = glm::angleAxis(std::numbers::pi / 2.0, glm::dvec3(0.0, 1.0, 0.0));
    disc.material = world_->add_material("retro", {.reflectance = 0.9, .retro_gain = 300.0});
    world_->create("disc", disc);
  }

  /// 64 pixels over 4 degrees: one is 1.1 mrad, 1.1 cm at 10 m.
  static std::string parameters(const std::string& methods) {
    return "{port: {body: wall, radius: 50 cm}, reflector: disc, reflector_size: 10 mm, pixels: 64, "
           "field_of_view: 4 deg, distances: [10 m, 150 m], layers: [station], batch: 4096, " +
           methods + "}";
  }

  std::vector<double> run(AnyModule& module) {
    std::vector<double> outputs;
    for (std::uint64_t i = 0; i < 2'000; ++i) {
      outputs = step(module, i, static_cast<std::int64_t>(i) * 1'000'000, 1'000'000);
      if (outputs[finished] == 1.0) break;
    }
    return outputs;
  }
};

TEST_F(PixelStudyModule, TilingBeamsDetectAndFewRaysDoNot) {
  const auto module =
      make(pixel_study_type(), parameters("samples: [1, 256], beams: [0.0885 deg]"), {.instance = "study"});
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  allocation_guard::reset();
  const std::vector<double> outputs = run(*module);
  EXPECT_EQ(allocation_guard::seen().total(), 0U) << "in the steps";
  EXPECT_EQ(outputs[finished], 1.0);
  EXPECT_EQ(outputs[progress], 1.0);
  EXPECT_EQ(outputs[tiling_beams_missed], 0.0);
  EXPECT_EQ(outputs[rays_detected_beyond], 0.0);
  EXPECT_EQ(outputs[incomplete], 0.0);

  contribution::Contribution report;
  module->contribute(report);
  ASSERT_EQ(report.sections.size(), 1U);
  const auto& rows = report.sections[0].tables.at(0).rows;
  ASSERT_EQ(rows.size(), 6U);
  const auto detected = [&](std::size_t row) { return rows[row][4].mark == contribution::Mark::good; };
  // By distance: one ray, 256 rays, the beam. Equation 2: 4.6 m for one ray, 73 m for 16 x 16.
  EXPECT_TRUE(detected(1)) << "256 rays at 10 m";
  EXPECT_TRUE(detected(2)) << "the beam at 10 m";
  EXPECT_FALSE(detected(3)) << "one ray at 150 m";
  EXPECT_TRUE(detected(5)) << "the beam at 150 m";

  ASSERT_EQ(report.images.size(), 6U);
  EXPECT_EQ(report.images[2].name, "study-0010m-beam0p0885deg");
  for (const contribution::Image& image : report.images) {
    ASSERT_EQ(image.grey.size(), 64U * 64U);
    if (image.name.find("0010m") == std::string::npos) continue;
    // 6 m are far wider than 4 degrees at 10 m: each traced pixel sees the wall.
    const auto grey = std::count_if(image.grey.begin(), image.grey.end(), [](int g) { return g > 0; });
    EXPECT_GT(grey, image.name.find("256") == std::string::npos ? 4095 : 3000) << image.name;
  }
  const auto white = [](const contribution::Image& image) {
    return std::count(image.grey.begin(), image.grey.end(), std::uint8_t{255});
  };
  EXPECT_GE(white(report.images[2]), 1) << "the disc in the picture of the beams";
  EXPECT_LE(white(report.images[2]), 9);
}

/// Such a study would report that nothing detects the reflector.
TEST_F(PixelStudyModule, RefusesAReflectorThatIsInNoLayerOrMoves) {
  const auto fault_of = [&](const std::string& reflector) {
    std::string text = parameters("samples: [1]");
    text.replace(text.find("disc,"), 4, reflector);
    try {
      make(pixel_study_type(), text, {.instance = "study"});
    } catch (const SetupError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  rtstdb::EntityRow row;
  row.geometry = world_->add_geometry(rtstdb::make_sphere(0.005), "sphere");
  row.mask = 0;
  world_->create("hidden", row);
  row.mask = 1;
  row.motion.v_world_mps = {0.0, 0.1, 0.0};
  world_->create("flying", row);
  EXPECT_NE(fault_of("hidden").find("'hidden' is in none of the study's layers"), std::string::npos);
  EXPECT_NE(fault_of("flying").find("moves; a study needs bodies at rest"), std::string::npos);
  EXPECT_EQ(fault_of("disc"), "");
}

TEST_F(PixelStudyModule, ThresholdIsAboveTheIntensityOfTheBeam) {
  // 0.9 * 300 * (5 mm)^2 / (10 m * 0.77 mrad)^2 / (10 m)^2 = 1.1 / m^2 at most.
  const auto module =
      make(pixel_study_type(), parameters("beams: [0.0885 deg], threshold: 1.3, images: false"),
           {.instance = "study"});
  ASSERT_NE(module, nullptr) << diagnostics_.to_text();
  EXPECT_EQ(run(*module)[tiling_beams_missed], 2.0);
  contribution::Contribution report;
  module->contribute(report);
  EXPECT_TRUE(report.images.empty());
}

}  // namespace
}  // namespace hil::modules
