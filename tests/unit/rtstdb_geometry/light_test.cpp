#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include <rtstdb/light.hpp>
#include <rtstdb/limits.hpp>

namespace rtstdb {
namespace {

const Light sun{.kind = LightKind::directional, .illuminance_lx = 1e5};
const Light lamp{.kind = LightKind::point, .intensity_cd = 100.0};
const Light beam{.kind = LightKind::spot, .intensity_cd = 100.0, .outer_angle_rad = 0.5};
const Light sky{.kind = LightKind::sky};
const std::vector<Light> one_of_each_kind{sun, lamp, beam, sky};

std::string refusal(const Light& light) {
  const auto result = validate_light(light);
  if (result) return "accepted";
  EXPECT_EQ(result.error().code, ErrorCode::bad_input);
  return result.error().message;
}
/// The light with another value of a member.
template <class Member>
std::string refusal(Light light, Member Light::*member, Member value) {
  light.*member = value;
  return refusal(light);
}

TEST(LightCheck, AcceptsItsLimits) {
  for (const Light& light : one_of_each_kind)
    EXPECT_EQ(refusal(light), "accepted") << to_string(light.kind);
  const double least = std::numeric_limits<double>::denorm_min();
  for (const double value : {least, max_illuminance_lx})
    EXPECT_EQ(refusal(sun, &Light::illuminance_lx, value), "accepted") << value;
  EXPECT_EQ(refusal(sun, &Light::angular_diameter_rad, max_angular_diameter_rad), "accepted");
  EXPECT_EQ(refusal(sun, &Light::color, glm::dvec3(max_light_color)), "accepted");
  EXPECT_EQ(refusal(sun, &Light::color, glm::dvec3(0.0, least, 0.0)), "accepted");
  for (const double value : {least, max_intensity_cd}) {
    EXPECT_EQ(refusal(lamp, &Light::intensity_cd, value), "accepted") << value;
    EXPECT_EQ(refusal(beam, &Light::intensity_cd, value), "accepted") << value;
  }
  EXPECT_EQ(refusal(lamp, &Light::p_m, glm::dvec3(max_coordinate_m, -max_coordinate_m, 0.0)), "accepted");
  for (const double value : {min_spot_angle_rad, max_spot_angle_rad})
    EXPECT_EQ(refusal(beam, &Light::outer_angle_rad, value), "accepted") << value;
  EXPECT_EQ(refusal(beam, &Light::inner_angle_rad, beam.outer_angle_rad), "accepted");
  for (const auto member : {&Light::zenith_cdpm2, &Light::horizon_cdpm2, &Light::ground_cdpm2})
    EXPECT_EQ(refusal(sky, member, glm::dvec3(max_luminance_cdpm2)), "accepted");
}

TEST(LightCheck, RefusesWithPropertyValueAndRange) {
  EXPECT_EQ(refusal(sun, &Light::illuminance_lx, 0.0),
            "illuminance_lx is 0; allowed is above 0, at most 1e7");
  EXPECT_EQ(refusal(sun, &Light::illuminance_lx, 2e7),
            "illuminance_lx is 20000000; allowed is above 0, at most 1e7");
  EXPECT_EQ(refusal(beam, &Light::p_m, glm::dvec3(0.0, 2e5, 0.0)), "p_m.y is 200000; allowed is -1e5 to 1e5");
  EXPECT_EQ(refusal(sun, &Light::angular_diameter_rad, 0.25),
            "angular_diameter_rad is 0.25; allowed is 0 to 0.2");
  EXPECT_EQ(refusal(sun, &Light::angular_diameter_rad, -0.1),
            "angular_diameter_rad is -0.1; allowed is 0 to 0.2");
  for (const Light& light : {sun, lamp, beam}) {
    EXPECT_EQ(refusal(light, &Light::color, {1.0, -0.5, 1.0}), "color.g is -0.5; allowed is 0 to 1000");
    EXPECT_EQ(refusal(light, &Light::color, {1.0, 1.0, 1001.0}), "color.b is 1001; allowed is 0 to 1000");
    EXPECT_EQ(refusal(light, &Light::color, {0.0, 0.0, 0.0}),
              "color is 0 in all channels; one has to be above 0");
  }
  for (const Light& light : {lamp, beam}) {
    EXPECT_EQ(refusal(light, &Light::intensity_cd, -1.0),
              "intensity_cd is -1; allowed is above 0, at most 1e10");
    EXPECT_EQ(refusal(light, &Light::intensity_cd, 2e10),
              "intensity_cd is 2e+10; allowed is above 0, at most 1e10");
  }
  EXPECT_EQ(refusal(beam, &Light::outer_angle_rad, 0.0), "outer_angle_rad is 0; allowed is 0.01 to 3.1416");
  EXPECT_EQ(refusal(beam, &Light::outer_angle_rad, 3.2), "outer_angle_rad is 3.2; allowed is 0.01 to 3.1416");
  EXPECT_EQ(refusal(beam, &Light::inner_angle_rad, 0.6),
            "inner_angle_rad is 0.6; allowed is 0 to the outer_angle_rad");
  EXPECT_EQ(refusal(beam, &Light::inner_angle_rad, -0.1),
            "inner_angle_rad is -0.1; allowed is 0 to the outer_angle_rad");
  EXPECT_EQ(refusal(sky, &Light::zenith_cdpm2, {0.0, -1.0, 0.0}),
            "zenith_cdpm2.g is -1; allowed is 0 to 1e10");
  EXPECT_EQ(refusal(sky, &Light::horizon_cdpm2, {2e10, 0.0, 0.0}),
            "horizon_cdpm2.r is 2e+10; allowed is 0 to 1e10");
  EXPECT_EQ(refusal(sky, &Light::ground_cdpm2, {0.0, 0.0, 2e10}),
            "ground_cdpm2.b is 2e+10; allowed is 0 to 1e10");
  EXPECT_EQ(refusal({.kind = static_cast<LightKind>(9)}),
            "kind is 9; allowed are the enumerators of LightKind");
}

TEST(LightCheck, RefusesWhatTheKindDoesNotUse) {
  EXPECT_EQ(refusal(sky, &Light::intensity_cd, 5.0),
            "intensity_cd is not used by a light of kind sky; leave it at its default");
  const auto unused = [](const char* name, auto member, auto value) {
    std::string kinds;
    for (const Light& light : one_of_each_kind)
      if (refusal(light, member, value) == std::string(name) + " is not used by a light of kind " +
                                               to_string(light.kind) + "; leave it at its default")
        kinds += std::string(to_string(light.kind)) + " ";
    return kinds;
  };
  EXPECT_EQ(unused("color", &Light::color, glm::dvec3(0.5)), "sky ");
  EXPECT_EQ(unused("p_m", &Light::p_m, glm::dvec3(1.0)), "directional sky ");
  EXPECT_EQ(unused("illuminance_lx", &Light::illuminance_lx, 1.0), "point spot sky ");
  EXPECT_EQ(unused("intensity_cd", &Light::intensity_cd, 1.0), "directional sky ");
  EXPECT_EQ(unused("inner_angle_rad", &Light::inner_angle_rad, 0.1), "directional point sky ");
  EXPECT_EQ(unused("outer_angle_rad", &Light::outer_angle_rad, 0.1), "directional point sky ");
  EXPECT_EQ(unused("angular_diameter_rad", &Light::angular_diameter_rad, 0.1), "point spot sky ");
  for (const auto& [name, member] :
       {std::pair("zenith_cdpm2", &Light::zenith_cdpm2), std::pair("horizon_cdpm2", &Light::horizon_cdpm2),
        std::pair("ground_cdpm2", &Light::ground_cdpm2)})
    EXPECT_EQ(unused(name, member, glm::dvec3(1.0)), "directional point spot ");
}

TEST(LightCheck, RefusesNumbersThatAreNotFinite) {
  const double infinite = std::numeric_limits<double>::infinity();
  for (const Light& light : one_of_each_kind) {
    for (const double value : {std::numeric_limits<double>::quiet_NaN(), infinite, -infinite}) {
      for (const auto member : {&Light::illuminance_lx, &Light::intensity_cd, &Light::inner_angle_rad,
                                &Light::outer_angle_rad, &Light::angular_diameter_rad})
        EXPECT_NE(refusal(light, member, value), "accepted") << to_string(light.kind) << " " << value;
      for (const auto member :
           {&Light::color, &Light::p_m, &Light::zenith_cdpm2, &Light::horizon_cdpm2, &Light::ground_cdpm2})
        EXPECT_NE(refusal(light, member, {1.0, 1.0, value}), "accepted") << to_string(light.kind);
    }
  }
}

}  // namespace
}  // namespace rtstdb
