// Eight clients append and read at once: one serial order explains what they saw, in agreement with real time.
//
// The same test is linked once more with each of several databases that were broken on purpose (CMakeLists.txt); there the judge
// has to find something.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/long/list_world.hpp"

namespace hil::torture {

/// What is wrong with the database that this is linked with; null: nothing.
extern const char* const broken;

namespace {

constexpr int clients = 8;
constexpr int transactions_each = 60;
#ifdef HIL_TORTURE_LONG
constexpr std::uint32_t rounds = 20000;
#else
constexpr std::uint32_t rounds = 210;
#endif

struct Judged {
  std::uint32_t rounds_with_findings = 0;
  std::string first;
  std::size_t transactions = 0, committed = 0, reads = 0;
};

Judged run_and_judge(std::uint32_t max_rounds, bool until_found) {
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
    if (judged.rounds_with_findings++ == 0)
      judged.first =
          "round " + std::to_string(round) + ": " + to_string(findings[0].anomaly) + ", " + findings[0].what;
    if (until_found) break;
  }
  return judged;
}

TEST(SerialHistory, OneOrderExplainsAllUnlessBroken) {
  if (broken != nullptr) {
    const Judged judged = run_and_judge(200, true);
    EXPECT_GT(judged.rounds_with_findings, 0u)
        << "nothing found in " << judged.transactions << " transactions, though " << broken;
    std::cout << broken << ": " << judged.first << "\n";
    return;
  }
  const Judged judged = run_and_judge(rounds, false);
  EXPECT_EQ(judged.rounds_with_findings, 0u) << judged.first;
  EXPECT_GT(judged.transactions, std::size_t{rounds} * clients * transactions_each * 9 / 10);
  EXPECT_GT(judged.committed, judged.transactions / 3);
  EXPECT_LT(judged.committed, judged.transactions * 19 / 20) << "nothing was refused, missed or in conflict";
  EXPECT_GT(judged.reads, judged.transactions / 2);
  std::cout << judged.transactions << " transactions, " << judged.committed << " committed, " << judged.reads
            << " reads of lists\n";
}

}  // namespace
}  // namespace hil::torture
