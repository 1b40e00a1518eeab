// Four readers and two writers at once: never half a pair, and never another place than that version's, neither in the latest version
// nor in a pinned one nor as of a past time.
//
// The same test is linked once more with each of several databases that were broken on purpose (CMakeLists.txt); there half a
// pair has to be seen.

#include "tests/long/canary_pairs.hpp"

#include <gtest/gtest.h>

#include <iostream>

namespace hil::torture {

/// What is wrong with the database that this is linked with; null: nothing.
extern const char* const broken;

namespace {

#if defined(HIL_TORTURE_LONG)
constexpr std::uint64_t questions = 10'000'000;
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::uint64_t questions = 20'000;
#else
constexpr std::uint64_t questions = 100'000;
#endif

TEST(CanaryPairs, AreNeverSeenInHalvesUnlessBroken) {
  CanaryPairs world;
  ASSERT_EQ(world.open(), "");
  const CanaryPairs::Seen seen = world.run(7, 4, 2, questions);
  std::cout << seen.questions << " questions in " << seen.transactions << " transactions, "
            << seen.of_the_past << " of the past, " << seen.too_old << " too old; " << seen.versions
            << " versions, " << seen.came_to_nothing << " moves came to nothing\n";
  if (broken != nullptr) {
    EXPECT_GT(seen.halves, 0u) << "nothing seen, though " << broken;
    std::cout << broken << ": " << seen.first_half << "\n";
    return;
  }
  EXPECT_EQ(seen.halves, 0u) << seen.first_half;
  EXPECT_GE(seen.questions, questions);
  EXPECT_GT(seen.of_the_past, 0u);
  EXPECT_GE(seen.versions, 50u);
  EXPECT_GT(seen.came_to_nothing, 0u);
}

}  // namespace
}  // namespace hil::torture
