// firm-never-late: whatever the load, what costs turn out to be, who cancels, and however the clock jumps, no
// firm commit is published after its deadline; and none is called missed before that has passed.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/long/simulated_load.hpp"
#include "tests/support/rounds.hpp"

namespace hil::stress {
namespace {

using namespace std::chrono_literals;
using rtstdb::DeadlineClass;
using rtstdb::LatePolicy;
using rtstdb::Outcome;
using rtstdb::Status;

const std::uint64_t at_each_load = tests::rounds(20'000, 2'000'000);

std::vector<Stream> streams(double load) {
  const Stream firm{.at_random = true,
                    .deadline_class = DeadlineClass::firm,
                    .shortest_deadline = 50us,
                    .longest_deadline = 20ms,
                    .max_importance = 2};
  std::vector<Stream> all(7, firm);
  const char* const names[] = {"read", "write", "write and ask", "long", "partial", "soft", "best effort"};
  for (std::size_t k = 0; k < all.size(); ++k)
    all[k].name = names[k];
  all[0].period = 1ms;
  all[0].fewest_elements = 1;
  all[0].max_elements = 300;
  all[1].period = 1ms;
  all[1].rows = 3;
  all[2].period = 2ms;
  all[2].rows = 2;
  all[2].fewest_elements = 1;
  all[2].max_elements = 500;
  all[3].period = 40ms;
  all[3].fewest_elements = 2000;
  all[3].max_elements = 10'000;
  all[4].period = 30ms;
  all[4].fewest_elements = 2500;
  all[4].max_elements = 20'000;
  all[4].late = LatePolicy::partial;
  all[5].period = 5ms;
  all[5].deadline_class = DeadlineClass::soft;
  all[5].fewest_elements = 100;
  all[5].max_elements = 1000;
  all[6].period = 4ms;
  all[6].deadline_class = DeadlineClass::best_effort;
  all[6].rows = 1;
  all[6].max_elements = 400;
  const double asked = load_of(all);
  for (Stream& stream : all)
    stream.period =
        Nanoseconds(static_cast<std::int64_t>(static_cast<double>(stream.period.count()) * asked / load));
  return all;
}

struct Judged {
  std::uint64_t ended = 0, committed = 0, missed = 0, refused = 0, cancelled = 0, partial = 0;
  std::uint64_t late_commits = 0, false_misses = 0, wrong_endings = 0;
};

void judge(const Ended& one, Judged& judged) {
  const Outcome& outcome = one.transaction->outcome();
  ++judged.ended;
  const bool firm = one.stream->deadline_class == DeadlineClass::firm;
  judged.late_commits += firm && outcome.done() && outcome.published > one.deadline;
  judged.false_misses += outcome.status == Status::missed && outcome.lateness <= 0ns;
  judged.committed += outcome.done();
  judged.missed += outcome.status == Status::missed;
  judged.refused += outcome.status == Status::refused;
  judged.cancelled += outcome.status == Status::cancelled;
  judged.partial += outcome.partial;
  switch (outcome.status) {
    case Status::committed:
    case Status::truncated:
    case Status::refused:
    case Status::cancelled:
      break;
    case Status::missed:
      judged.wrong_endings += !firm;
      break;
    case Status::late:
      judged.wrong_endings += one.stream->deadline_class != DeadlineClass::soft;
      break;
    default:
      ++judged.wrong_endings;
  }
}

TEST(FirmNeverLate, AtLoadsFromHalfToThreeTimesWhatCanBeDone) {
  std::uint64_t seed = 1;
  std::uint64_t missed = 0;
  std::uint64_t cancelled = 0;
  std::uint64_t partial = 0;
  for (const double load : {0.5, 1.0, 1.5, 2.0, 3.0}) {
    SCOPED_TRACE(testing::Message() << "load " << load << ", seed " << seed);
    SimulatedLoad world({.seed = seed++,
                         .spread = 0.5,
                         .one_dear_in = 50,
                         .one_jump_in = 5000,
                         .one_cancelled_in = 40,
                         .queue_capacity = 64});
    for (const Stream& stream : streams(load))
      world.add(stream);
    Judged judged;
    world.run(at_each_load, [&](const Ended& one) { judge(one, judged); });
    std::cout << "load " << load << ": " << judged.ended << " transactions, " << judged.committed
              << " committed (" << judged.partial << " in part), " << judged.missed << " missed, "
              << judged.refused << " refused, " << judged.cancelled << " cancelled; " << judged.late_commits
              << " firm commits after their deadline\n";
    EXPECT_EQ(judged.late_commits, 0u);
    EXPECT_EQ(judged.false_misses, 0u);
    EXPECT_EQ(judged.wrong_endings, 0u);
    EXPECT_EQ(judged.ended, at_each_load) << "each has one outcome";
    const rtstdb::TransactionCounts counts = world.engine().counts();
    EXPECT_EQ(counts.firm_late_commits, 0u);
    EXPECT_EQ(
        counts.committed + counts.truncated + counts.late + counts.missed + counts.refused + counts.cancelled,
        counts.submitted);
    EXPECT_GT(judged.committed, at_each_load / 10) << "or nothing was put to the test";
    missed += judged.missed;
    cancelled += judged.cancelled;
    partial += judged.partial;
  }
  EXPECT_GT(missed, at_each_load / 100);
  EXPECT_GT(cancelled, at_each_load / 1000);
  EXPECT_GT(partial, 0u);
}

}  // namespace
}  // namespace hil::stress
