// Eight clients append and read at once: one serial order explains what they saw, in agreement with real
// time.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/long/list_world.hpp"
#include "tests/support/rounds.hpp"

namespace hil::stress {
namespace {

constexpr int clients = 8;
constexpr int transactions_each = 60;

struct Judged {
  std::string first_finding;
  std::size_t transactions = 0, committed = 0, reads = 0;
};

/// Ends with the first round that has findings.
Judged run_and_judge(std::uint32_t max_rounds) {
  ListWorld world;
  Judged judged;
  for (std::uint32_t round = 0; round < max_rounds; ++round) {
    const std::vector<Recorded> history = world.run(round, clients, transactions_each);
    for (const Recorded& one : history) {
      ++judged.transactions;
      judged.committed += one.ending == Ending::committed ? 1 : 0;
      judged.reads += one.reads.size();
    }
    const auto findings = find_anomalies(history);
    if (findings.empty()) continue;
    judged.first_finding =
        "round " + std::to_string(round) + ": " + to_string(findings[0].anomaly) + ", " + findings[0].what;
    break;
  }
  return judged;
}

TEST(SerialHistory, OneOrderExplainsAll) {
  const auto rounds = static_cast<std::uint32_t>(tests::rounds(210, 20'000));
  const Judged judged = run_and_judge(rounds);
  ASSERT_EQ(judged.first_finding, "");
  EXPECT_GT(judged.transactions, std::size_t{rounds} * clients * transactions_each * 9 / 10);
  EXPECT_GT(judged.committed, judged.transactions / 3);
  EXPECT_LT(judged.committed, judged.transactions * 19 / 20) << "nothing was refused, missed or in conflict";
  EXPECT_GT(judged.reads, judged.transactions / 2);
  std::cout << judged.transactions << " transactions, " << judged.committed << " committed, " << judged.reads
            << " reads of lists\n";
}

}  // namespace
}  // namespace hil::stress
