#include "io/can/filter.hpp"

#include <gtest/gtest.h>

#include <span>

namespace hil::io::can {
namespace {

TEST(FilterSet, FollowsTheKernelsRule) {
  FilterSet filters;
  EXPECT_TRUE(filters.passes(0x123));
  const can_filter list[] = {{0x120, 0x7F0}, {0x300 | CAN_INV_FILTER, 0x700}};
  filters.assign(std::span(list, 1));
  EXPECT_TRUE(filters.passes(0x12F));
  EXPECT_FALSE(filters.passes(0x130));
  filters.assign(list);
  EXPECT_TRUE(filters.passes(0x130)) << "not 0x3xx";
  EXPECT_FALSE(filters.passes(0x3F0));
}

}  // namespace
}  // namespace hil::io::can
