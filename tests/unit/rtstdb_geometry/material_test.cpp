#include <gtest/gtest.h>

#include <limits>

#include <rtstdb/limits.hpp>
#include <rtstdb/material.hpp>

namespace rtstdb {
namespace {

TEST(MaterialCheck, AcceptsItsLimits) {
  EXPECT_TRUE(validate(Material{}).ok());
  EXPECT_FALSE(Material{}.is_retro_reflector());
  for (const double reflectance : {0.0, 1.0})
    for (const double gain : {0.0, 1.0, max_retro_gain})
      EXPECT_TRUE(validate({.reflectance = reflectance, .retro_gain = gain}).ok())
          << reflectance << " " << gain;
}

TEST(MaterialCheck, RefusesWithPropertyValueAndRange) {
  const auto refusal = [](const Material& material) {
    const auto result = validate(material);
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
  for (const double value : {infinite, -infinite, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_NE(refusal({.reflectance = value}), "accepted") << value;
    EXPECT_NE(refusal({.retro_gain = value}), "accepted") << value;
  }
}

}  // namespace
}  // namespace rtstdb
