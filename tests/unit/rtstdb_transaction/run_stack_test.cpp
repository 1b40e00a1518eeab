// The stack of nested runs, and the time that counts for each.

#include "rtstdb/scheduler/run_stack.hpp"

#include <gtest/gtest.h>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;
using scheduler::RunStack;
using scheduler::RunTime;

constexpr ClockTime start = clock_time_ns(1'000'000'000);

TEST(RunTimeTest, CountsBetweenStartAndStop) {
  RunTime time;
  EXPECT_EQ(time.total(start), 0ms);
  time.start(start);
  EXPECT_EQ(time.total(start + 2ms), 2ms);
  time.stop(start + 3ms);
  EXPECT_EQ(time.total(start + 9ms), 3ms);
  time.start(start + 10ms);
  EXPECT_EQ(time.total(start + 11ms), 4ms);
}

TEST(RunStackTest, KnowsTheRunThatTheInnermostPreempts) {
  World world;
  const auto lower = world.make();
  const auto higher = world.make();
  RunStack runs;
  EXPECT_TRUE(runs.empty());
  scheduler::Run& outer = runs.push(static_cast<TransactionImpl&>(*lower), start);
  EXPECT_EQ(runs.preempted_by_innermost(), nullptr);
  runs.push(static_cast<TransactionImpl&>(*higher), start + 1ms);
  EXPECT_EQ(runs.depth(), 2u);
  EXPECT_EQ(runs.preempted_by_innermost(), nullptr) << "it runs while the outer one waits for the device";
  EXPECT_EQ(outer.time.total(start + 2ms), 2ms);
  runs.pop();
  outer.time.stop(start + 3ms);
  outer.preempted_at = start + 3ms;
  scheduler::Run& inner = runs.push(static_cast<TransactionImpl&>(*higher), start + 4ms);
  EXPECT_EQ(runs.preempted_by_innermost(), &outer);
  EXPECT_EQ(&runs.innermost(), &inner);
  EXPECT_FALSE(runs.any_staged());
  inner.staged = true;
  EXPECT_TRUE(runs.any_staged());
  runs.pop();
  EXPECT_FALSE(runs.any_staged());
  EXPECT_EQ(outer.time.total(start + 9ms), 3ms);
}

TEST(PreemptionTest, ADrainCountsForThePreemptedRun) {
  World world;
  const auto lower = world.make();
  const auto higher = world.make();
  store::Store store({8, 64, [](GeometryId) { return true; }});
  scheduler::ReadyQueue queue(4);
  scheduler::Reservations reservations;
  scheduler::Preemption preemption(queue, reservations, store, world.clock);
  lower->begin(terms(DeadlineClass::soft));
  higher->begin(terms(DeadlineClass::soft, ClockTime::max(), 7));
  scheduler::Run& outer = preemption.runs().push(static_cast<TransactionImpl&>(*lower), world.clock.now());
  world.clock.advance(2ms);
  queue.push(static_cast<TransactionImpl&>(*higher));
  ASSERT_TRUE(preemption.is_due());
  preemption.suspend();
  ASSERT_EQ(preemption.next(), &static_cast<TransactionImpl&>(*higher));
  scheduler::Run& inner = preemption.runs().push(static_cast<TransactionImpl&>(*higher), world.clock.now());
  preemption.begin_drain();
  world.clock.advance(4ms);
  preemption.end_drain();
  world.clock.advance(1ms);
  EXPECT_EQ(inner.time.total(world.clock.now()), 1ms);
  EXPECT_EQ(outer.time.total(world.clock.now()), 6ms);
  preemption.runs().pop();
  EXPECT_EQ(preemption.next(), nullptr);
  preemption.resume();
  world.clock.advance(3ms);
  EXPECT_EQ(outer.time.total(world.clock.now()), 9ms);
  EXPECT_FALSE(outer.must_restart);
}

}  // namespace
}  // namespace rtstdb::transaction::test
