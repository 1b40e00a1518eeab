#include "rtstdb/store/free_indices.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace rtstdb::store {
namespace {

TEST(FreeIndices, AreTakenLowestFirst) {
  for (const std::uint32_t count : {1u, 63u, 64u, 65u, 4096u, 4097u, 300000u}) {
    FreeIndices free(count);
    for (std::uint32_t expected = 0; expected < count; ++expected) {
      ASSERT_EQ(free.acquire_lowest(), expected) << "of " << count;
    }
    EXPECT_FALSE(free.acquire_lowest()) << "of " << count;
    free.release(count - 1);
    EXPECT_EQ(free.acquire_lowest(), count - 1);
  }
}

TEST(FreeIndices, AgreeWithAnOrderedSet) {
  for (const std::uint32_t count : {5u, 64u, 130u, 5000u}) {
    std::mt19937 random(count);
    FreeIndices free(count);
    std::set<std::uint32_t> model;
    for (std::uint32_t i = 0; i < count; ++i)
      model.insert(i);
    for (int step = 0; step < 20000; ++step) {
      const auto index = static_cast<std::uint32_t>(random() % count);
      if (random() % 3 == 0) {
        const auto taken = free.acquire_lowest();
        ASSERT_EQ(taken.has_value(), !model.empty());
        if (!taken) continue;
        ASSERT_EQ(*taken, *model.begin());
        model.erase(*taken);
      } else if (model.count(index) != 0) {
        free.acquire(index);
        model.erase(index);
      } else {
        free.release(index);
        model.insert(index);
      }
    }
  }
}

TEST(FreeIndicesDeathTest, MisuseAborts) {
  FreeIndices free(10);
  EXPECT_DEATH(free.release(3), "free_indices.cpp.* the index is free or beyond the last one");
  free.acquire(3);
  EXPECT_DEATH(free.acquire(3), "free_indices.cpp.* the index is in use or beyond the last one");
  EXPECT_DEATH(free.acquire(64), "free_indices.cpp.* the index is in use or beyond the last one");
  EXPECT_DEATH(free.acquire(10), "free_indices.cpp.* the index is in use or beyond the last one");
}

}  // namespace
}  // namespace rtstdb::store
