#include <gtest/gtest.h>

#include <limits>

#include <rtstdb/limits.hpp>
#include <rtstdb/material.hpp>

namespace rtstdb {
namespace {

TEST(MaterialCheck, AcceptsItsLimits) {
  EXPECT_TRUE(validate_material(Material{}).ok());
  EXPECT_FALSE(Material{}.is_retro_reflector());
  for (const double reflectance : {0.0, 1.0})
    for (const double gain : {0.0, 1.0, max_retro_gain})
      EXPECT_TRUE(validate_material({.reflectance = reflectance, .retro_gain = gain}).ok())
          << reflectance << " " << gain;
  const Material lowest{
      .base_color = glm::dvec3(0.0), .metallic = 0.0, .roughness = 0.0, .refractive_index = 1.0};
  const Material highest{.base_color = glm::dvec3(1.0),
                         .metallic = 1.0,
                         .roughness = 1.0,
                         .emission_cdpm2 = glm::dvec3(max_luminance_cdpm2),
                         .transmission = 1.0,
                         .refractive_index = max_refractive_index};
  EXPECT_TRUE(validate_material(lowest).ok());
  EXPECT_TRUE(validate_material(highest).ok());
}

TEST(MaterialCheck, RefusesWithPropertyValueAndRange) {
  const auto refusal = [](const Material& material) {
    const auto result = validate_material(material);
    if (result) return std::string("accepted");
    EXPECT_EQ(result.error().code, ErrorCode::bad_input);
    return result.error().message;
  };
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal({.reflectance = 1.25}), "reflectance is 1.25; allowed is 0 to 1");
  EXPECT_EQ(refusal({.reflectance = -0.5}), "reflectance is -0.5; allowed is 0 to 1");
  EXPECT_EQ(refusal({.retro_gain = 0.5}), "retro_gain is 0.5; allowed is 0, or 1 to 1e6");
  EXPECT_EQ(refusal({.retro_gain = -1.0}), "retro_gain is -1; allowed is 0, or 1 to 1e6");
  EXPECT_EQ(refusal({.retro_gain = 1e7}), "retro_gain is 10000000; allowed is 0, or 1 to 1e6");
  EXPECT_EQ(refusal({.base_color{0.5, 1.5, 0.5}}), "base_color.g is 1.5; allowed is 0 to 1");
  EXPECT_EQ(refusal({.base_color{-0.1, 0.5, 0.5}}), "base_color.r is -0.1; allowed is 0 to 1");
  EXPECT_EQ(refusal({.metallic = 1.5}), "metallic is 1.5; allowed is 0 to 1");
  EXPECT_EQ(refusal({.metallic = -0.5}), "metallic is -0.5; allowed is 0 to 1");
  EXPECT_EQ(refusal({.roughness = 1.5}), "roughness is 1.5; allowed is 0 to 1");
  EXPECT_EQ(refusal({.roughness = -0.5}), "roughness is -0.5; allowed is 0 to 1");
  EXPECT_EQ(refusal({.emission_cdpm2{0.0, 0.0, 2e10}}), "emission_cdpm2.b is 2e+10; allowed is 0 to 1e10");
  EXPECT_EQ(refusal({.emission_cdpm2{0.0, -1.0, 0.0}}), "emission_cdpm2.g is -1; allowed is 0 to 1e10");
  EXPECT_EQ(refusal({.transmission = 1.5}), "transmission is 1.5; allowed is 0 to 1");
  EXPECT_EQ(refusal({.transmission = -0.5}), "transmission is -0.5; allowed is 0 to 1");
  EXPECT_EQ(refusal({.refractive_index = 0.5}), "refractive_index is 0.5; allowed is 1 to 4");
  EXPECT_EQ(refusal({.refractive_index = 4.5}), "refractive_index is 4.5; allowed is 1 to 4");
  for (const double value : {infinite, -infinite, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_NE(refusal({.reflectance = value}), "accepted") << value;
    EXPECT_NE(refusal({.retro_gain = value}), "accepted") << value;
    EXPECT_NE(refusal({.base_color{0.5, 0.5, value}}), "accepted") << value;
    EXPECT_NE(refusal({.metallic = value}), "accepted") << value;
    EXPECT_NE(refusal({.roughness = value}), "accepted") << value;
    EXPECT_NE(refusal({.emission_cdpm2{value, 0.0, 0.0}}), "accepted") << value;
    EXPECT_NE(refusal({.transmission = value}), "accepted") << value;
    EXPECT_NE(refusal({.refractive_index = value}), "accepted") << value;
  }
}

}  // namespace
}  // namespace rtstdb
