#include "rtstdb/query/region/id_order.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace rtstdb::query {
namespace {

TEST(IdOrder, SortsIds) {
  std::mt19937_64 random(51);
  IdOrder order;
  for (const std::uint32_t limit : {1u, 63u, 64u, 65u, 5'000u, 300'000u, max_entities}) {
    std::vector<std::uint32_t> all(limit);
    for (std::uint32_t i = 0; i < limit; ++i)
      all[i] = i;
    for (const std::uint32_t count : {0u, 1u, 2u, 7u, 8u, 9u, 50u, 63u, 64u, 65u, 4'000u, max_entities}) {
      std::ranges::shuffle(all, random);
      const std::vector<std::uint32_t> ids(all.begin(), all.begin() + std::min(count, limit));
      std::vector<std::uint32_t> expected = ids;
      std::ranges::sort(expected);
      std::vector<std::uint32_t> sorted;
      order.ascending(ids, [&](std::uint32_t id) { sorted.push_back(id); });
      EXPECT_EQ(sorted, expected) << count << " below " << limit;
    }
  }
}

TEST(IdOrder, RemovesDuplicates) {
  std::mt19937_64 random(52);
  IdOrder order;
  for (const std::uint32_t count : {2u, 9u, 64u, 65u, 1'000u}) {
    std::vector<std::uint32_t> ids(count);
    for (std::uint32_t& id : ids)
      id = static_cast<std::uint32_t>(random() % (count / 2));
    std::vector<std::uint32_t> expected = ids;
    std::ranges::sort(expected);
    expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
    ASSERT_LT(expected.size(), ids.size());
    std::vector<std::uint32_t> sorted;
    order.ascending(ids, [&](std::uint32_t id) { sorted.push_back(id); });
    EXPECT_EQ(sorted, expected) << count;
  }
}

}  // namespace
}  // namespace rtstdb::query
