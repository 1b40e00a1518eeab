// Four readers and two writers at once: never half a pair, and never another place than that version's,
// neither in the latest version nor in a pinned one nor as of a past time.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/long/canary_pairs.hpp"
#include "tests/support/rounds.hpp"

namespace hil::stress {
namespace {

TEST(CanaryPairs, AreNeverSeenInHalves) {
  const std::uint64_t questions = tests::rounds(100'000, 10'000'000);
  CanaryPairs world;
  ASSERT_EQ(world.open(), "");
  const CanaryPairs::Seen seen = world.run(7, 4, 2, questions);
  std::cout << seen.questions << " questions in " << seen.transactions << " transactions, "
            << seen.of_the_past << " of the past, " << seen.too_old << " too old; " << seen.versions
            << " versions, " << seen.came_to_nothing << " moves came to nothing\n";
  EXPECT_EQ(seen.halves, 0u) << seen.first_half;
  EXPECT_GE(seen.questions, questions);
  EXPECT_GT(seen.of_the_past, 0u);
  EXPECT_GE(seen.versions, 50u);
  EXPECT_GT(seen.came_to_nothing, 0u);
}

}  // namespace
}  // namespace hil::stress
