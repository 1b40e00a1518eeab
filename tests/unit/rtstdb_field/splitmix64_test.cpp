// The first numbers that the authors' reference program draws after a seed of 1234567.

#include "rtstdb/splitmix64.hpp"

#include <gtest/gtest.h>

namespace rtstdb {
namespace {

TEST(SplitMix64, DrawsTheNumbersOfTheReferenceProgram) {
  SplitMix64 random(1234567);
  EXPECT_EQ(random.next(), 6457827717110365317u);
  EXPECT_EQ(random.next(), 3203168211198807973u);
  EXPECT_EQ(random.next(), 9817491932198370423u);
  EXPECT_EQ(random.uniform(), static_cast<double>(4593380528125082431u >> 11) * 0x1p-53);
}

}  // namespace
}  // namespace rtstdb
