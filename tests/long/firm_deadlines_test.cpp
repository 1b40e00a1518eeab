// No firm transaction is published after its deadline, and none is reported as missed before it, under any
// load, with random costs, cancellations and clock jumps.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/long/simulated_load.hpp"
#include "tests/support/rounds.hpp"

namespace hil::long_test {
namespace {

using namespace std::chrono_literals;
using rtstdb::DeadlineClass;
using rtstdb::Outcome;
using rtstdb::Status;

const std::uint64_t transactions_per_load = tests::rounds(20'000, 2'000'000);

std::vector<Stream> streams(double load) {
  auto all = streams_of({.at_random = true,
                         .deadline_class = DeadlineClass::firm,
                         .min_deadline = 50us,
                         .max_deadline = 20ms,
                         .max_importance = 2},
                        {{"read", 1ms, 1, 300},
                         {"write", 1ms, 0, 0, 3},
                         {"write and query", 2ms, 1, 500, 2},
                         {"long", 40ms, 2000, 10'000},
                         {"partial", 30ms, 2500, 20'000},
                         {"soft", 5ms, 100, 1000},
                         {"best effort", 4ms, 0, 400, 1}});
  all[4].late = rtstdb::LatePolicy::partial;
  all[5].deadline_class = DeadlineClass::soft;
  all[6].deadline_class = DeadlineClass::best_effort;
  const double factor = load_of(all) / load;
  for (Stream& stream : all)
    stream.period =
        Nanoseconds(static_cast<std::int64_t>(static_cast<double>(stream.period.count()) * factor));
  return all;
}

struct Counts {
  std::uint64_t ended = 0, committed = 0, missed = 0, refused = 0, cancelled = 0, partial = 0;
  std::uint64_t late_commits = 0, false_misses = 0, invalid_outcomes = 0;
};

void count(const CompletedTransaction& one, Counts& counts) {
  using enum Status;
  const Outcome& outcome = one.transaction->outcome();
  const Status status = outcome.status;
  const DeadlineClass deadline_class = one.stream->deadline_class;
  const bool firm = deadline_class == DeadlineClass::firm;
  ++counts.ended;
  counts.committed += outcome.done();
  counts.missed += status == missed;
  counts.refused += status == refused;
  counts.cancelled += status == cancelled;
  counts.partial += outcome.partial;
  counts.late_commits += firm && outcome.done() && outcome.published > one.deadline;
  counts.false_misses += status == missed && outcome.lateness <= 0ns;
  const bool valid = status == committed || status == truncated || status == refused || status == cancelled ||
                     (status == missed && firm) || (status == late && deadline_class == DeadlineClass::soft);
  counts.invalid_outcomes += !valid;
}

TEST(FirmDeadlines, NoTransactionIsPublishedLateAtAnyLoad) {
  std::uint64_t seed = 1;
  Counts all;
  for (const double load : {0.5, 1.0, 1.5, 2.0, 3.0}) {
    SCOPED_TRACE(testing::Message() << "load " << load << ", seed " << seed);
    SimulatedLoad world({.seed = seed++,
                         .cost_spread = 0.5,
                         .expensive_batch_one_in = 50,
                         .clock_jump_one_in = 5000,
                         .cancelled_one_in = 40,
                         .queue_capacity = 64});
    for (const Stream& stream : streams(load))
      world.add(stream);
    Counts counts;
    world.run(transactions_per_load, [&](const CompletedTransaction& one) { count(one, counts); });
    std::cout << "load " << load << ": " << counts.committed << " committed (" << counts.partial
              << " in part), " << counts.missed << " missed, " << counts.refused << " refused, "
              << counts.cancelled << " cancelled\n";
    EXPECT_EQ(counts.late_commits, 0u);
    EXPECT_EQ(counts.false_misses, 0u);
    EXPECT_EQ(counts.invalid_outcomes, 0u);
    EXPECT_EQ(counts.ended, transactions_per_load);
    const rtstdb::TransactionCounts total = world.engine().counts();
    EXPECT_EQ(total.firm_late_commits, 0u);
    EXPECT_EQ(total.committed + total.truncated + total.late + total.missed + total.refused + total.cancelled,
              total.submitted);
    EXPECT_GT(counts.committed, transactions_per_load / 10);
    all.missed += counts.missed;
    all.cancelled += counts.cancelled;
    all.partial += counts.partial;
  }
  EXPECT_GT(all.missed, transactions_per_load / 100);
  EXPECT_GT(all.cancelled, transactions_per_load / 1000);
  EXPECT_GT(all.partial, 0u);
}

}  // namespace
}  // namespace hil::long_test
