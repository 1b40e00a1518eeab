// Four clients append and read at once in a database with a device: one serial order explains what they saw,
// in agreement with real time.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/long/device_lists.hpp"
#include "tests/support/rounds.hpp"

namespace hil::stress {
namespace {

constexpr int clients = 4;
constexpr int transactions_each = 50;

TEST(DeviceHistory, OneOrderExplainsAll) {
  const auto rounds = static_cast<std::uint32_t>(tests::rounds(3, 100));
  DeviceLists world;
  ASSERT_EQ(world.open(), "");
  std::size_t transactions = 0;
  std::size_t committed = 0;
  std::size_t reads = 0;
  std::string found;
  for (std::uint32_t round = 0; round < rounds && found.empty(); ++round) {
    const std::vector<Recorded> history = world.run(round, clients, transactions_each);
    for (const Recorded& one : history) {
      ++transactions;
      committed += one.ending == Ending::committed ? 1 : 0;
      reads += one.reads.size();
    }
    const auto findings = find_anomalies(history);
    if (!findings.empty())
      found =
          "round " + std::to_string(round) + ": " + to_string(findings[0].anomaly) + ", " + findings[0].what;
  }
  std::cout << transactions << " transactions, " << committed << " committed, " << reads
            << " reads of lists\n";
  EXPECT_EQ(found, "");
  EXPECT_GT(committed, transactions / 4);
  EXPECT_LT(committed, transactions) << "nothing was refused, missed, cancelled or in conflict";
  EXPECT_GT(reads, transactions / 4);
}

}  // namespace
}  // namespace hil::stress
