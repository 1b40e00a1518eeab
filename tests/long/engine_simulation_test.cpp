// Courses of events through the engine on a simulated machine, each from a seed. HIL_SIM_SEED=n plays one
// again.

#include "tests/long/engine_simulation.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "tests/support/rounds.hpp"

namespace hil::stress {
namespace {

constexpr std::uint64_t steps_each = 10'000;
/// Far longer than a course takes on any machine.
constexpr unsigned longest_course_s = 300;
/// So many meet everything that can happen.
constexpr std::uint64_t seeds_that_meet_all = 100;

std::atomic<std::uint64_t> watched_seed{0};

/// A course that stands still says which it was, and ends the program.
class Watch {
 public:
  explicit Watch(std::uint64_t seed) {
    watched_seed = seed;
    std::signal(SIGALRM, [](int) {
      std::fprintf(stderr, "HIL_SIM_SEED=%llu stands still\n",
                   static_cast<unsigned long long>(watched_seed.load()));
      std::abort();
    });
    alarm(longest_course_s);
  }
  ~Watch() { alarm(0); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
};

void expect_all_of_the_disk(const SimulationCounts& counts) {
  using rtstdb::RefusedBy;
  for (const RefusedBy by : {RefusedBy::admission, RefusedBy::log_full, RefusedBy::log_fault})
    EXPECT_GT(counts.refused[static_cast<std::size_t>(by)], 0u) << to_string(by);
  EXPECT_GT(counts.storage.power_lost, 0u);
  EXPECT_GT(counts.storage.killed, 0u);
  EXPECT_GT(counts.storage.not_opened, 0u);
  EXPECT_GT(counts.storage.refused_calls, 0u);
  EXPECT_GT(counts.storage.stalls, 0u);
  EXPECT_GT(counts.closed, 0u);
  EXPECT_GT(counts.losing_lives, 0u);
  EXPECT_GT(counts.doubts_that_stood, 0u);
  EXPECT_GT(counts.in_doubt, counts.doubts_that_stood);
  EXPECT_GT(counts.durable, 0u);
  EXPECT_GT(counts.not_durable, 0u);
  EXPECT_GT(counts.gaps, 0u);
}

TEST(EngineSimulation, AModelExplainsEverything) {
  SimulationCounts counts;
  const char* const chosen = std::getenv("HIL_SIM_SEED");
  const std::uint64_t first = chosen != nullptr ? std::strtoull(chosen, nullptr, 10) : 1;
  const std::uint64_t last = chosen != nullptr ? first : tests::rounds(120, 3'000);
  std::string fault;
  for (std::uint64_t seed = first; seed <= last && fault.empty(); ++seed) {
    const Watch watch(seed);
    EngineSimulation simulation(seed);
    fault = simulation.run(steps_each);
    counts.add(simulation.counts());
  }
  ASSERT_EQ(fault, "");
  std::cout << counts.steps << " steps";
  for (std::size_t k = 0; k < counts.ended.size(); ++k) {
    if (counts.ended[k] > 0) std::cout << ", " << counts.ended[k] << " " << to_string(rtstdb::Status(k));
  }
  std::cout << ", " << counts.in_gaps << " runs in gaps, " << counts.losses << " losses, "
            << counts.observations << " observations\n"
            << counts.storage.lives << " lives with a log: " << counts.storage.power_lost
            << " ended with the power, " << counts.storage.killed << " killed, " << counts.closed
            << " closed; " << counts.losing_lives << " lost what they may, " << counts.doubts_that_stood
            << " of " << counts.in_doubt << " doubts stood; " << counts.storage.refused_calls
            << " calls refused, " << counts.storage.stalls << " stalls, " << counts.gaps << " gaps, "
            << counts.storage.not_opened << " not opened at once; " << counts.durable << " durable, "
            << counts.not_durable << " not\n";
  if (last - first + 1 < seeds_that_meet_all) return;
  using rtstdb::Status;
  for (const Status status :
       {Status::committed, Status::late, Status::missed, Status::refused, Status::conflict, Status::cancelled,
        Status::truncated, Status::device_lost, Status::bad_input})
    EXPECT_GT(counts.ended[static_cast<std::size_t>(status)], 0u) << to_string(status);
  EXPECT_GT(counts.in_gaps, 0u);
  EXPECT_GT(counts.losses_in_gaps, 0u);
  EXPECT_GT(counts.given_back_waiting, 0u);
  EXPECT_GT(counts.passed_by_write_helper, 0u);
  EXPECT_GT(counts.full_queues, 0u);
  expect_all_of_the_disk(counts);
}

}  // namespace
}  // namespace hil::stress
