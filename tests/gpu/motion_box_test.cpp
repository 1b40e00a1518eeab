// Boxes of moving and turning entities on the device, in fewer worlds than in long_random_test.cpp.

#include "tests/gpu/motion_box_fuzz.hpp"

namespace rtstdb::test {
namespace {

TEST_F(MotionBoxFuzz, FindsNothingOutsideOfItsBox) {
  for (std::uint64_t seed = 0; seed < 200 && !HasFailure(); ++seed)
    fuzz(seed);
  EXPECT_EQ(versions(), 800u);
  EXPECT_GT(counts().builds, 150u);
  EXPECT_GT(counts().refits, 100u);
  EXPECT_GT(counts().patches, 300u);
  RecordProperty("points", std::to_string(points()));
}

}  // namespace
}  // namespace rtstdb::test
