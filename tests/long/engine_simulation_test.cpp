// Simulations of the engine, each from a seed. HIL_SIM_SEED=n repeats one.

#include "tests/long/engine_simulation.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "tests/support/rounds.hpp"

namespace hil::long_test {
namespace {

constexpr std::uint64_t steps_each = 10'000;
/// Longer than a seed takes on any machine.
constexpr unsigned seed_limit_s = 300;
/// The number of seeds that cause every event.
constexpr std::uint64_t seeds_for_all_events = 100;

std::atomic<std::uint64_t> watched_seed{0};

/// Ends the program and names the seed when a simulation does not end.
class SeedTimeLimit {
 public:
  explicit SeedTimeLimit(std::uint64_t seed) {
    watched_seed = seed;
    std::signal(SIGALRM, [](int) {
      std::fprintf(stderr, "HIL_SIM_SEED=%llu does not end\n",
                   static_cast<unsigned long long>(watched_seed.load()));
      std::abort();
    });
    alarm(seed_limit_s);
  }
  ~SeedTimeLimit() { alarm(0); }
  SeedTimeLimit(const SeedTimeLimit&) = delete;
  SeedTimeLimit& operator=(const SeedTimeLimit&) = delete;
};

void expect_all_disk_events(const SimulationCounts& counts) {
  using rtstdb::RefusedBy;
  for (const RefusedBy by : {RefusedBy::admission, RefusedBy::log_full, RefusedBy::log_fault})
    EXPECT_GT(counts.refused[static_cast<std::size_t>(by)], 0u) << to_string(by);
  EXPECT_GT(counts.storage.power_lost, 0u);
  EXPECT_GT(counts.storage.killed, 0u);
  EXPECT_GT(counts.storage.failed_opens, 0u);
  EXPECT_GT(counts.storage.failed_calls, 0u);
  EXPECT_GT(counts.storage.stalls, 0u);
  EXPECT_GT(counts.closed, 0u);
  EXPECT_GT(counts.processes_with_losses, 0u);
  EXPECT_GT(counts.recovered_doubts, 0u);
  EXPECT_GT(counts.in_doubt, counts.recovered_doubts);
  EXPECT_GT(counts.durable, 0u);
  EXPECT_GT(counts.not_durable, 0u);
  EXPECT_GT(counts.gaps, 0u);
}

TEST(EngineSimulation, OutcomesAgreeWithTheModel) {
  SimulationCounts counts;
  const char* const chosen = std::getenv("HIL_SIM_SEED");
  const std::uint64_t first = chosen != nullptr ? std::strtoull(chosen, nullptr, 10) : 1;
  const std::uint64_t last = chosen != nullptr ? first : tests::rounds(120, 3'000);
  std::string fault;
  for (std::uint64_t seed = first; seed <= last && fault.empty(); ++seed) {
    const SeedTimeLimit limit(seed);
    EngineSimulation simulation(seed);
    fault = simulation.run(steps_each);
    counts.add(simulation.counts());
  }
  ASSERT_EQ(fault, "");
  std::cout << counts.steps << " steps";
  for (std::size_t k = 0; k < counts.ended.size(); ++k) {
    if (counts.ended[k] > 0) std::cout << ", " << counts.ended[k] << " " << to_string(rtstdb::Status(k));
  }
  std::cout << ", " << counts.nested_runs << " nested runs, " << counts.losses << " device losses, "
            << counts.observations << " observations\n"
            << counts.storage.processes << " processes with a log: " << counts.storage.power_lost
            << " power failures, " << counts.storage.killed << " killed, " << counts.closed << " closed; "
            << counts.processes_with_losses << " with lost commits, " << counts.recovered_doubts << " of "
            << counts.in_doubt << " commits in doubt recovered; " << counts.storage.failed_calls
            << " failed disk calls, " << counts.storage.stalls << " stalls, " << counts.gaps << " gaps, "
            << counts.storage.failed_opens << " failed opens; " << counts.durable << " durable, "
            << counts.not_durable << " not\n";
  if (last - first + 1 < seeds_for_all_events) return;
  using rtstdb::Status;
  for (const Status status :
       {Status::committed, Status::late, Status::missed, Status::refused, Status::conflict, Status::cancelled,
        Status::truncated, Status::device_lost, Status::bad_input})
    EXPECT_GT(counts.ended[static_cast<std::size_t>(status)], 0u) << to_string(status);
  EXPECT_GT(counts.nested_runs, 0u);
  EXPECT_GT(counts.losses_in_nested_runs, 0u);
  EXPECT_GT(counts.lost_while_waiting, 0u);
  EXPECT_GT(counts.commits_by_write_helper, 0u);
  EXPECT_GT(counts.full_queues, 0u);
  expect_all_disk_events(counts);
}

TEST(EngineSimulation, OneSeedGivesOneSequenceOfEvents) {
  for (std::uint64_t seed = 7; seed <= 12; ++seed) {
    SimulationCounts counts[2];
    for (SimulationCounts& one : counts) {
      EngineSimulation simulation(seed);
      ASSERT_EQ(simulation.run(steps_each), "");
      one = simulation.counts();
    }
    EXPECT_TRUE(counts[0] == counts[1]) << "HIL_SIM_SEED=" << seed;
  }
}

}  // namespace
}  // namespace hil::long_test
