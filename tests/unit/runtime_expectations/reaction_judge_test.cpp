// Reactions, counts and orders of conditions, tick by tick.

#include "runtime/expectations/reaction_judge.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

constexpr double unknown_speed = std::numeric_limits<double>::quiet_NaN();

class Occurrences : public Expectations {
 protected:
  static Reaction reaction(std::int64_t within_ns, std::uint64_t at_least = 1) {
    return {condition("bus.Header.Counter == 1"), condition("ego.speed > 5"), within_ns, at_least};
  }
  /// One tick of 1 ms after the other.
  void tick(Judge& judge, double request, double speed) {
    table_.write(request_, request, time_ns_);
    table_.write(speed_, speed, time_ns_);
    judge.check(table_, {.time_ns = time_ns_});
    time_ns_ += ms;
  }
  report::Expectation expect_now(const Judge& judge, Result expected,
                                 std::initializer_list<const char*> words = {}) {
    return expect(judge, until(time_ns_, static_cast<std::uint64_t>(time_ns_ / ms)), expected, words);
  }
  std::int64_t time_ns_ = 0;
};

TEST_F(Occurrences, ReactionInTimeIsHeld) {
  const auto judge = this->judge(reaction(3 * ms));
  tick(*judge, 0, 0);
  tick(*judge, 1, 0);  // begins at 1 ms
  tick(*judge, 1, 0);
  tick(*judge, 1, 0);
  tick(*judge, 1, 9);  // 3 ms later
  const auto result = expect_now(*judge, Result::held);
  EXPECT_EQ(
      result.detail,
      "when bus.Header.Counter == 1 then ego.speed > 5 within 3 ms: 1 of 1 reaction in time, the slowest "
      "after 3 ms, at 0.001 s");
  const auto times = judge->response_times(time_ns_);
  ASSERT_TRUE(times);
  EXPECT_EQ(times->samples_ns, std::vector<std::int64_t>{3 * ms});
  EXPECT_EQ(times->limit_ns, 3 * ms);
}

TEST_F(Occurrences, ReactionThatComesATickTooLateFails) {
  const auto judge = this->judge(reaction(3 * ms));
  for (const double speed : {0.0, 0.0, 0.0, 0.0, 9.0})
    tick(*judge, 1, speed);  // true in the first tick: begins there
  const auto result = expect_now(*judge, Result::failed, {"0 of 1 reaction in time"});
  EXPECT_EQ(result.first_failure_ns, 3 * ms);
}

TEST_F(Occurrences, ConditionThatIsTrueAlreadyReactsAtOnce) {
  const auto judge = this->judge(reaction(3 * ms));
  tick(*judge, 0, 9);
  tick(*judge, 1, 9);
  expect_now(*judge, Result::held, {"the slowest after 0, at 0.001 s"});
}

TEST_F(Occurrences, EachReactionCounts) {
  const auto judge = this->judge(reaction(2 * ms, 3));
  for (int i = 0; i < 2; ++i) {
    tick(*judge, 1, 0);
    tick(*judge, 0, 9);
  }
  expect_now(*judge, Result::not_checked, {"2 of 2 reactions in time", "at least 3 have to be judged"});
  tick(*judge, 1, 0);
  tick(*judge, 0, 0);
  tick(*judge, 1, 0);  // the one before is late, and another one begins
  tick(*judge, 0, 9);
  expect_now(*judge, Result::failed, {"3 of 4 reactions in time"});
}

TEST_F(Occurrences, OneReactionCompletesAllThatAreOpen) {
  const auto judge = this->judge(reaction(10 * ms));
  for (int i = 0; i < 3; ++i) {
    tick(*judge, 1, 0);
    tick(*judge, 0, 0);
  }
  tick(*judge, 0, 9);
  expect_now(*judge, Result::held, {"3 of 3 reactions in time", "the slowest after 6 ms, at 0.000 s"});
}

TEST_F(Occurrences, OpenReactionAtTheEndIsNotJudged) {
  const auto judge = this->judge(reaction(10 * ms));
  tick(*judge, 1, 0);
  tick(*judge, 0, 0);
  expect_now(*judge, Result::not_checked, {"0 of 0 reactions in time; 1 not judged"});
}

TEST_F(Occurrences, UnknownReactionIsNotJudged) {
  const auto judge = this->judge(reaction(2 * ms));
  tick(*judge, 1, 0);
  tick(*judge, 0, unknown_speed);
  tick(*judge, 0, 0);
  tick(*judge, 0, 0);
  expect_now(*judge, Result::not_checked, {"1 not judged"});
}

TEST_F(Occurrences, SkippedTicksDoNotMakeAReactionInTime) {
  const auto judge = this->judge(reaction(3 * ms));
  tick(*judge, 1, 0);
  time_ns_ = 9 * ms;
  tick(*judge, 1, 9);
  expect_now(*judge, Result::failed, {"0 of 1 reaction in time"});
}

TEST_F(Occurrences, ReactionThatHasToLastIsHeldWhereItBeganInTime) {
  Reaction claim = reaction(3 * ms);
  claim.hold_ns = 4 * ms;
  const auto judge = this->judge(claim);
  tick(*judge, 1, 0);
  for (const double speed : {9, 0, 9, 9, 9, 9})  // from 3 ms on
    tick(*judge, 1, speed);
  expect_now(*judge, Result::not_checked, {"0 of 0 reactions in time and for long enough; 1 not judged"});
  tick(*judge, 1, 9);
  const auto result = expect_now(*judge, Result::held);
  EXPECT_EQ(
      result.detail,
      "when bus.Header.Counter == 1 then ego.speed > 5 within 3 ms for at least 4 ms: 1 of 1 reaction in "
      "time and for long enough, the slowest after 3 ms, at 0.000 s");
  EXPECT_EQ(result.margin, 0.0);
  EXPECT_EQ(result.worst_ns, 0);
}

TEST_F(Occurrences, ReactionThatEndsTooEarlyFails) {
  Reaction claim = reaction(3 * ms);
  claim.hold_ns = 4 * ms;
  const auto judge = this->judge(claim);
  tick(*judge, 1, 0);
  for (const double speed : {0, 9, 9, 9, 0, 9, 9, 9, 9, 9})  // breaks off at 5 ms, and lasts from 6 ms on
    tick(*judge, 1, speed);
  const auto result = expect_now(*judge, Result::failed);
  EXPECT_EQ(
      result.detail,
      "when bus.Header.Counter == 1 then ego.speed > 5 within 3 ms for at least 4 ms: 0 of 1 reaction in "
      "time and for long enough; 1 too short: 'then' became true after 2 ms and stayed true for 2 ms instead "
      "of 4 ms, at "
      "0.000 "
      "s");
  EXPECT_EQ(result.first_failure_ns, 5 * ms);
  EXPECT_DOUBLE_EQ(result.margin, -0.002) << "stayed for 2 ms of 4 ms";
  EXPECT_EQ(result.worst_ns, 0);
}

TEST_F(Occurrences, LongestTimeOfAReactionCounts) {
  Reaction claim = reaction(5 * ms);
  claim.hold_ns = 4 * ms;
  const auto judge = this->judge(claim);
  tick(*judge, 1, 0);
  for (const double speed : {9, 0, 9, 9, 9, 0, 0, 0, 0})
    tick(*judge, 1, speed);
  expect_now(*judge, Result::failed,
             {"became true after 3 ms and stayed true for 2 ms instead of 4 ms, at 0.000 s"});
  EXPECT_DOUBLE_EQ(judge->result(until(time_ns_, 10)).margin, -0.002);
}

TEST_F(Occurrences, MarginOfAReactionThatHasToLastIsThatOfTheShortestOne) {
  Reaction claim = reaction(50 * ms);
  claim.hold_ns = 2 * ms;
  const auto judge = this->judge(claim);
  tick(*judge, 1, 0);
  for (const double speed : {9, 9, 9, 9, 0})  // stays for 3 ms
    tick(*judge, 1, speed);
  EXPECT_DOUBLE_EQ(expect_now(*judge, Result::held).margin, 0.001);
  tick(*judge, 0, 0);
  tick(*judge, 1, 9);
  while (time_ns_ < 100 * ms)
    tick(*judge, 1, 0);
  tick(*judge, 0, 0);
  tick(*judge, 1, 0);
  while (time_ns_ < 200 * ms)
    tick(*judge, 1, 0);
  const auto result = expect_now(*judge, Result::failed,
                                 {"1 of 3 reactions in time and for long enough", "1 too short: 'then'",
                                  "became true after 0 and stayed true for 0 instead of 2 ms, at 0.007 s",
                                  "1 came too late or not at all"});
  EXPECT_DOUBLE_EQ(result.margin, 0.05 - 0.099) << "to the end of the run";
  EXPECT_EQ(result.worst_ns, 101 * ms);
}

TEST_F(Occurrences, LateReactionIsLateUpToItsFirstTickHoweverLongItStays) {
  Reaction claim = reaction(3 * ms);
  claim.hold_ns = 4 * ms;
  const auto judge = this->judge(claim);
  tick(*judge, 1, 0);
  for (const double speed : {0, 0, 0, 9, 0, 0, 0, 0, 0, 0})
    tick(*judge, 1, speed);
  EXPECT_DOUBLE_EQ(expect_now(*judge, Result::failed).margin, -0.001) << "4 ms of 3 ms";
}

TEST_F(Occurrences, MarginOfAReactionCountsLateOnes) {
  const auto judge = this->judge(reaction(3 * ms));
  for (const double speed : {0, 9, 0, 0, 0, 0, 0})
    tick(*judge, time_ns_ == 0 || time_ns_ == 2 * ms ? 1 : 0, speed);
  auto result = expect_now(*judge, Result::failed, {"1 of 2 reactions in time"});
  EXPECT_DOUBLE_EQ(result.margin, -0.002) << "5 ms to the end";
  EXPECT_EQ(result.worst_ns, 2 * ms);
  tick(*judge, 0, 9);
  tick(*judge, 0, 9);
  tick(*judge, 0, 9);
  result = expect_now(*judge, Result::failed);
  EXPECT_DOUBLE_EQ(result.margin, -0.002) << "it came 5 ms later";
}

TEST_F(Occurrences, GapInALongReactionIsNotJudged) {
  Reaction claim = reaction(5 * ms);
  claim.hold_ns = 50 * ms;
  const auto judge = this->judge(claim);
  for (int i = 0; i < 100; ++i)
    tick(*judge, i < 10 ? 0 : 1, i >= 30 && i < 32 ? unknown_speed : 9);
  expect_now(*judge, Result::not_checked, {"0 of 0 reactions", "1 not judged, since 'then' was unknown"});
}

TEST_F(Occurrences, GapThatCouldNotMakeItLongEnoughIsNoExcuse) {
  Reaction claim = reaction(5 * ms);
  claim.hold_ns = 50 * ms;
  const auto judge = this->judge(claim);
  for (int i = 0; i < 100; ++i)
    tick(*judge, i < 10 ? 0 : 1, i >= 30 && i < 32 ? unknown_speed : i < 32 ? 9 : 0);
  expect_now(*judge, Result::failed, {"1 too short", "stayed true for 19 ms instead of 50 ms"});
}

/// A verdict on reactions is that of every possible `then`.
TEST_F(Occurrences, VerdictsHoldForEveryPossibleThen) {
  std::mt19937 random(11);
  std::array<int, 3> verdicts{};
  for (int variant = 0; variant < 6000; ++variant) {
    Reaction claim = reaction(static_cast<std::int64_t>(1 + random() % 4) * ms);
    claim.hold_ns = static_cast<std::int64_t>(random() % 5) * ms;
    constexpr int length = 24;
    const auto begin = static_cast<int>(random() % 4);
    std::vector<double> speeds(length);
    std::vector<std::size_t> gaps;
    for (std::size_t i = 0; i < speeds.size(); ++i) {
      const auto draw = random() % 10;
      speeds[i] = draw < 2 && gaps.size() < 5 ? unknown_speed : draw < 7 ? 9 : 0;
      if (draw < 2 && std::isnan(speeds[i])) gaps.push_back(i);
    }
    const auto run = [&](const std::vector<double>& all) {
      config::Expectation expectation{.name = "claim", .place = {}, .claim = claim_of(claim)};
      expectation.coverage = 0.0;
      const auto judge = judge_of_expectation(expectation);
      time_ns_ = 0;
      for (int i = 0; i < length; ++i)
        tick(*judge, i < begin ? 0 : 1, all[static_cast<std::size_t>(i)]);
      return judge->result(until(time_ns_, length));
    };
    const auto found = run(speeds);
    ++verdicts[static_cast<std::size_t>(found.result)];
    int held = 0, failed = 0;
    for (unsigned choice = 0; choice < 1U << gaps.size(); ++choice) {
      std::vector<double> possible = speeds;
      for (std::size_t k = 0; k < gaps.size(); ++k)
        possible[gaps[k]] = (choice >> k & 1U) != 0 ? 9 : 0;
      const auto result = run(possible).result;
      held += result == Result::held ? 1 : 0;
      failed += result == Result::failed ? 1 : 0;
      ASSERT_NE(result, Result::not_checked);
    }
    if (found.result == Result::held) {
      ASSERT_EQ(failed, 0) << "variant " << variant;
    }
    if (found.result == Result::failed) {
      ASSERT_EQ(held, 0) << "variant " << variant << found.detail;
    }
    if (held == 0) {
      ASSERT_EQ(found.result, Result::failed) << "variant " << variant << found.detail;
    }
  }
  for (const int count : verdicts)
    EXPECT_GT(count, 300);
}

TEST_F(Occurrences, CountHasALargestAndALeastNumber) {
  const auto judge = this->judge(Count{condition("ego.speed > 5"), 2, 3});
  tick(*judge, 0, 9);
  tick(*judge, 0, 9);
  expect_now(*judge, Result::failed, {"became true 1 time, last at 0.000 s; at least 2 are required"});
  tick(*judge, 0, 0);
  tick(*judge, 0, 9);
  expect_now(*judge, Result::held, {"became true 2 times"});
  for (const double speed : {0.0, 9.0, 0.0, 9.0})
    tick(*judge, 0, speed);
  const auto result = expect_now(*judge, Result::failed, {"at most 3 are permitted, exceeded at 0.007 s"});
  EXPECT_EQ(result.first_failure_ns, 7 * ms);
}

TEST_F(Occurrences, CountOfAnUnknownConditionIsNotChecked) {
  const auto judge = this->judge(Count{condition("ego.speed > 5"), 0, 3});
  for (int i = 0; i < 10; ++i)
    tick(*judge, 0, i < 5 ? unknown_speed : 0.0);
  expect_now(*judge, Result::not_checked, {"evaluated on 5 of 10 ticks"});
}

TEST_F(Occurrences, OrderIsThatOfTheFirstTimes) {
  const Order claim{
      {condition("ego.speed > 1"), condition("ego.speed > 2"), condition("bus.Header.Counter == 1")}};
  const auto held = judge(claim);
  tick(*held, 0, 0);
  tick(*held, 0, 3);  // both in one tick
  tick(*held, 0, 0);
  expect_now(*held, Result::failed, {"bus.Header.Counter == 1 never"});
  tick(*held, 1, 0);
  const auto in_order = expect_now(
      *held, Result::held,
      {"ego.speed > 1 at 0.001 s, then ego.speed > 2 at 0.001 s, then bus.Header.Counter == 1 at 0.003 s"});
  EXPECT_EQ(in_order.margin, 0.0);
  EXPECT_EQ(in_order.worst_ns, ms);
  const auto failed = judge(claim);
  time_ns_ = 0;
  tick(*failed, 0, 1.5);
  tick(*failed, 1, 1.5);
  tick(*failed, 1, 3);
  const auto result =
      expect_now(*failed, Result::failed, {"'bus.Header.Counter == 1' was true before 'ego.speed > 2'"});
  EXPECT_EQ(result.first_failure_ns, ms);
  EXPECT_EQ(result.margin, -0.001);
  EXPECT_EQ(result.margin_unit, "s");
  EXPECT_EQ(result.worst_ns, ms);
}

TEST_F(Occurrences, AreJudgedWithoutAllocation) {
  const auto judges = {judge(reaction(3 * ms)), judge(Count{condition("ego.speed > 5"), 0, 3}),
                       judge(Order{{condition("ego.speed > 1"), condition("ego.speed > 2")}})};
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int i = 0; i < 60; ++i)
    for (const auto& judge : judges)
      tick(*judge, i % 3, i % 11);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::expectations
