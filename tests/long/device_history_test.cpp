// Four clients append and read at once in a database with a device: one serial order explains what they saw, in agreement with real time.
//
// The same test is linked once more with a database that was broken on purpose (CMakeLists.txt); there the judge has to find something.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/long/device_lists.hpp"

namespace hil::torture {

/// What is wrong with the database that this is linked with; null: nothing.
extern const char* const broken;

namespace {

constexpr int clients = 4;
constexpr int transactions_each = 50;
#if defined(HIL_TORTURE_LONG)
constexpr std::uint32_t rounds = 100;
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::uint32_t rounds = 1;
#else
constexpr std::uint32_t rounds = 3;
#endif

TEST(DeviceHistory, OneOrderExplainsAllUnlessBroken) {
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
  if (broken != nullptr) {
    EXPECT_NE(found, "") << "nothing found, though " << broken;
    std::cout << broken << ": " << found << "\n";
    return;
  }
  EXPECT_EQ(found, "");
  EXPECT_GT(committed, transactions / 4);
  EXPECT_LT(committed, transactions) << "nothing was refused, missed, cancelled or in conflict";
  EXPECT_GT(reads, transactions / 4);
}

}  // namespace
}  // namespace hil::torture
