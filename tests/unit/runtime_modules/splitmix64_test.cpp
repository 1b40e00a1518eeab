// The first numbers that the authors' reference program draws after a seed of 1234567.

#include <gtest/gtest.h>

#include <hil/splitmix64.hpp>

namespace hil::modules {
namespace {

TEST(ModuleSplitMix64, DrawsTheNumbersOfTheReferenceProgram) {
  EXPECT_EQ(splitmix64(1234567), 6457827717110365317u);
  EXPECT_EQ(splitmix64(1234567 + splitmix64_step), 3203168211198807973u);
  EXPECT_EQ(splitmix64(1234567 + 2 * splitmix64_step), 9817491932198370423u);
  EXPECT_EQ(splitmix64_finalizer(0), 0u);
}

}  // namespace
}  // namespace hil::modules
