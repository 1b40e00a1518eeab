#include "rtstdb/query/id_order.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace rtstdb::query {
namespace {

TEST(IdOrder, SortsAsComparingDoes) {
  std::mt19937_64 random(51);
  IdOrder order;
  for (const std::uint32_t limit : {1u, 63u, 64u, 65u, 5'000u, 300'000u, max_entities}) {
    std::vector<std::uint32_t> all(limit);
    for (std::uint32_t i = 0; i < limit; ++i)
      all[i] = i;
    for (const std::uint32_t count : {0u, 1u, 2u, 50u, 4'000u, max_entities}) {
      std::ranges::shuffle(all, random);
      std::vector<std::uint32_t> ids(all.begin(), all.begin() + std::min(count, limit));
      std::vector<std::uint32_t> wanted = ids;
      std::ranges::sort(wanted);
      order.sort(ids);
      EXPECT_EQ(ids, wanted) << count << " below " << limit;
    }
  }
}

TEST(IdOrder, TheLastIdIsTheLast) {
  std::vector<std::uint32_t> ids{max_entities - 1, 0};
  IdOrder().sort(ids);
  EXPECT_EQ(ids, (std::vector<std::uint32_t>{0, max_entities - 1}));
}

}  // namespace
}  // namespace rtstdb::query
