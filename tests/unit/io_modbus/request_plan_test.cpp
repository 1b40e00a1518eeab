#include "io/modbus/request_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "registers.hpp"

namespace hil::io::modbus {
namespace {

using test::entry;

std::vector<std::size_t> all_of(const RegisterMap& map) {
  std::vector<std::size_t> indices(map.entries.size());
  std::iota(indices.begin(), indices.end(), 0U);
  return indices;
}

RegisterMap words(std::uint16_t first, std::uint16_t count) {
  RegisterMap map;
  for (std::uint16_t i = 0; i < count; ++i) {
    map.entries.push_back(entry(test::numbered("r", i), Table::holding, static_cast<std::uint16_t>(first + i),
                                ValueType::u16, true));
  }
  return map;
}

TEST(RequestPlan, RequestsKeepTheLimitsOfTheProtocol) {
  const RegisterMap map = words(0, 250);
  EXPECT_EQ(plan_requests(map, all_of(map), Access::read, 0).size(), 2U);   // 125 each
  EXPECT_EQ(plan_requests(map, all_of(map), Access::write, 0).size(), 3U);  // 123 each
  RegisterMap bits;
  for (std::uint16_t i = 0; i < 2001; ++i) {
    bits.entries.push_back(entry(test::numbered("b", i), Table::coil, i, ValueType::boolean, true));
  }
  const std::vector<PlannedRequest> reads = plan_requests(bits, all_of(bits), Access::read, 0);
  ASSERT_EQ(reads.size(), 2U);
  EXPECT_EQ(reads[0].count, 2000);
  EXPECT_EQ(plan_requests(bits, all_of(bits), Access::write, 0)[0].count, 1968);
}

TEST(RequestPlan, GapsAreReadUpToTheLimitAndNeverWritten) {
  const RegisterMap map{{entry("a", Table::holding, 0, ValueType::u16, true),
                         entry("b", Table::holding, 4, ValueType::u32, true)}};
  EXPECT_EQ(plan_requests(map, all_of(map), Access::read, 3).size(), 1U);
  EXPECT_EQ(plan_requests(map, all_of(map), Access::read, 3)[0].count, 6);
  EXPECT_EQ(plan_requests(map, all_of(map), Access::read, 2).size(), 2U);
  EXPECT_EQ(plan_requests(map, all_of(map), Access::write, 100).size(), 2U);
}

TEST(RequestPlan, TheLastAddressIsReached) {
  const RegisterMap map{{entry("last", Table::input, 65532, ValueType::u64, false)}};
  const std::vector<PlannedRequest> plan = plan_requests(map, all_of(map), Access::read, 65535);
  ASSERT_EQ(plan.size(), 1U);
  EXPECT_EQ(plan[0].address, 65532);
  EXPECT_EQ(plan[0].count, 4);
}

TEST(RequestPlan, NothingChosenNeedsNoRequest) {
  EXPECT_TRUE(plan_requests(words(0, 3), {}, Access::read, 0).empty());
}

/// The fewest requests for entries sorted by address, by dynamic programming over all partitions.
std::size_t fewest(const std::vector<RegisterEntry>& sorted, std::uint32_t gap, std::uint32_t limit) {
  std::vector<std::size_t> best(sorted.size() + 1, sorted.size() + 1);
  best[0] = 0;
  for (std::size_t last = 0; last < sorted.size(); ++last) {
    for (std::size_t first = 0; first <= last; ++first) {
      bool possible = sorted[last].address + width_of(sorted[last].type) - sorted[first].address <=
                      static_cast<int>(limit);
      for (std::size_t i = first; i < last; ++i) {
        possible = possible && sorted[i + 1].address - sorted[i].address - width_of(sorted[i].type) <=
                                   static_cast<int>(gap);
      }
      if (possible) best[last + 1] = std::min(best[last + 1], best[first] + 1);
    }
  }
  return best.back();
}

TEST(RequestPlan, RandomMapsGetTheFewestCompleteRequests) {
  std::mt19937 random(99);
  const std::array types{ValueType::u16, ValueType::f32, ValueType::f64};
  for (int round = 0; round < 500; ++round) {
    RegisterMap map;
    auto address = static_cast<std::uint32_t>(random() % 50);
    for (std::uint16_t i = 0; i < 60; ++i) {
      map.entries.push_back(entry(test::numbered("r", i), Table::holding, static_cast<std::uint16_t>(address),
                                  types[random() % types.size()], true));
      address += width_of(map.entries.back().type);
      if (random() % 3 == 0) address += static_cast<std::uint32_t>(random() % 12);
    }
    const std::vector<RegisterEntry> sorted = map.entries;
    std::shuffle(map.entries.begin(), map.entries.end(), random);
    const auto gap = static_cast<std::uint16_t>(random() % 12);
    for (const Access access : {Access::read, Access::write}) {
      const std::uint16_t limit = access == Access::read ? 125 : 123;
      const std::uint16_t effective_gap = access == Access::read ? gap : 0;
      const std::vector<PlannedRequest> plan = plan_requests(map, all_of(map), access, gap);
      ASSERT_EQ(plan.size(), fewest(sorted, effective_gap, limit)) << "round " << round;
      std::vector<int> carried(map.entries.size(), 0);
      for (const PlannedRequest& request : plan) {
        ASSERT_LE(request.count, limit);
        std::uint32_t width = 0;
        for (const std::size_t index : request.entries) {
          ++carried[index];
          width += width_of(map.entries[index].type);
          ASSERT_GE(map.entries[index].address, request.address);
          ASSERT_LE(map.entries[index].address + width_of(map.entries[index].type),
                    request.address + request.count);
        }
        ASSERT_TRUE(access == Access::read || width == request.count) << "a write between registers";
      }
      ASSERT_TRUE(std::all_of(carried.begin(), carried.end(), [](int times) { return times == 1; }));
    }
  }
}

}  // namespace
}  // namespace hil::io::modbus
