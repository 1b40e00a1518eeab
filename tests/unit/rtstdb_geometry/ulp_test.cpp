// The unit in the last place against the neighbours of a value.

#include "rtstdb/geometry/ulp.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace rtstdb {
namespace {

double to_next_value(float value) {
  return static_cast<double>(std::nextafter(value, std::numeric_limits<float>::infinity())) -
         static_cast<double>(value);
}

TEST(Ulp, IsTheDistanceToTheNextValue) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> exponent(-130, 126);
  std::uniform_real_distribution<float> mantissa(1.0f, 2.0f);
  for (int i = 0; i < 10'000; ++i) {
    const float value = std::ldexp(mantissa(random), exponent(random));
    ASSERT_EQ(ulp_m(static_cast<double>(value)), to_next_value(value)) << value;
    ASSERT_EQ(ulp_m(-static_cast<double>(value)), to_next_value(value)) << value;
  }
  EXPECT_EQ(ulp_m(0.0), static_cast<double>(std::numeric_limits<float>::denorm_min()));
  EXPECT_EQ(ulp_m(1.0), 0x1p-23);
}

TEST(Ulp, OfPointsIsThatOfTheLargestCoordinate) {
  EXPECT_EQ(ulp_m(std::vector<glm::vec3>{{1.0f, -9.0f, 3.0f}, {0.0f, 0.5f, 7.0f}}), to_next_value(9.0f));
}

}  // namespace
}  // namespace rtstdb
