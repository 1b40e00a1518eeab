#include "runtime/modules/laser_scanner/target_list.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace hil::modules {
namespace {

Target bright(double intensity, double range_m) {
  return {.range_m = range_m, .intensity_per_m2 = intensity};
}

TEST(TargetList, KeepsTheBrightestInOrder) {
  std::minstd_rand random(1);
  for (const std::uint32_t capacity : {1u, 3u, 8u}) {
    TargetList list(capacity);
    std::vector<Target> all;
    for (int k = 0; k < 200; ++k) {
      // Few different intensities, so that many are equal.
      all.push_back(bright(static_cast<double>(random() % 7), k));
      list.add(all.back());
      std::vector<Target> expected = all;
      std::ranges::stable_sort(expected, std::greater{}, &Target::intensity_per_m2);
      expected.resize(std::min<std::size_t>(expected.size(), capacity));
      ASSERT_EQ(list.found(), all.size());
      ASSERT_EQ(list.brightest().size(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i)
        ASSERT_EQ(list.brightest()[i].range_m, expected[i].range_m) << "the first of equally bright ones";
    }
    list.clear();
    EXPECT_EQ(list.found(), 0u);
    EXPECT_TRUE(list.brightest().empty());
  }
}

TEST(TargetList, WithoutSlotsCountsOnly) {
  TargetList list(0);
  list.add(bright(1.0, 1.0));
  EXPECT_EQ(list.found(), 1u);
  EXPECT_TRUE(list.brightest().empty());
}

}  // namespace
}  // namespace hil::modules
