#include "runtime/run/expectations.hpp"

#include <gtest/gtest.h>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_run/judged_signals.hpp"

namespace hil::run {
namespace {

TEST_F(Expectations, NeverHoldsUntilTheFirstTickThatBreaksIt) {
  const auto never = judge(config::Never{condition("ego.speed > 14")});
  look(*never, 14.0, 0);
  look(*never, 3.0, ms);
  EXPECT_EQ(never->result(until(2 * ms)).result, Result::held);
  EXPECT_EQ(never->result(until(2 * ms)).detail, "never ego.speed > 14: held for 2 ticks");
  EXPECT_FALSE(never->result(until(2 * ms)).first_failure_ns);
  look(*never, 14.5, 2 * ms);
  look(*never, 0.0, 3 * ms);
  look(*never, 20.0, 4 * ms);
  const auto result = never->result(until(5 * ms));
  EXPECT_EQ(result.result, Result::failed);
  EXPECT_EQ(result.name, "claim");
  EXPECT_EQ(result.first_failure_ns, 2 * ms);
  EXPECT_EQ(result.detail, "never ego.speed > 14: broken at 0.002 s");
  EXPECT_FALSE(never->response_times(5 * ms));
}

TEST_F(Expectations, AlwaysIsTheOtherWayRound) {
  const auto always = judge(config::Always{condition("ego.speed >= 0")});
  look(*always, 0.0, 0);
  EXPECT_EQ(always->result(until(ms)).result, Result::held);
  look(*always, -0.001, ms);
  EXPECT_EQ(always->result(until(2 * ms)).result, Result::failed);
  EXPECT_EQ(always->result(until(2 * ms)).first_failure_ns, ms);
}

TEST_F(Expectations, ARunWithoutATickProvesNothing) {
  const auto is_not_checked = [](const std::unique_ptr<Judge>& judge) {
    return judge->result(until(0, 0)).result == Result::not_checked;
  };
  EXPECT_TRUE(is_not_checked(judge(config::Never{condition("ego.speed > 14")})));
  EXPECT_TRUE(is_not_checked(judge(config::Always{condition("ego.speed >= 0")})));
  EXPECT_TRUE(is_not_checked(judge(config::Eventually{condition("ego.speed == 0"), std::nullopt})));
  EXPECT_TRUE(is_not_checked(responses(50 * ms)));
}

TEST_F(Expectations, EventuallyIsMetOnce) {
  const auto eventually = judge(config::Eventually{condition("ego.speed == 0"), std::nullopt});
  look(*eventually, 5.0, 0);
  EXPECT_EQ(eventually->result(until(ms)).result, Result::failed);
  look(*eventually, 0.0, 7 * ms);
  look(*eventually, 5.0, 8 * ms);
  EXPECT_EQ(eventually->result(until(9 * ms)).result, Result::held);
  EXPECT_EQ(eventually->result(until(9 * ms)).detail, "eventually ego.speed == 0: at 0.007 s");
  EXPECT_EQ(eventually->result(until(9 * ms)).met_ns, 7 * ms);
}

TEST_F(Expectations, EventuallyKeepsItsTimeLimit) {
  const auto in_time = judge(config::Eventually{condition("ego.speed == 0"), 5 * ms});
  look(*in_time, 0.0, 5 * ms);
  EXPECT_EQ(in_time->result(until(9 * ms)).result, Result::held);
  const auto late = judge(config::Eventually{condition("ego.speed == 0"), 5 * ms});
  look(*late, 5.0, 0);
  look(*late, 0.0, 6 * ms);
  const auto result = late->result(until(9 * ms));
  EXPECT_EQ(result.result, Result::failed);
  EXPECT_EQ(result.first_failure_ns, 5 * ms);
  EXPECT_NE(result.detail.find("only at 0.006 s, required by 0.005 s"), std::string::npos) << result.detail;
}

TEST_F(Expectations, EventuallyFailsWithinTheRunEvenWhenItWasCutShort) {
  const auto eventually = judge(config::Eventually{condition("ego.speed == 0"), 9'000 * ms});
  look(*eventually, 5.0, 0);
  const auto result = eventually->result(until(3'000 * ms));
  EXPECT_EQ(result.result, Result::failed);
  EXPECT_EQ(result.first_failure_ns, 3'000 * ms);
  EXPECT_EQ(result.detail, "eventually ego.speed == 0: not in 3.000 s");
}

TEST_F(Expectations, AConditionSeesTheValuesOfItsOwnSignals) {
  const auto never = judge(config::Never{condition("ego.speed > 14 and bus.Header.Counter == 2")});
  table_.write(reply_, 2.0, 0);
  look(*never, 20.0, 0);
  EXPECT_EQ(never->result(until(ms)).result, Result::held);
  table_.write(request_, 2.0, ms);
  look(*never, 20.0, ms);
  EXPECT_EQ(never->result(until(2 * ms)).result, Result::failed);
}

TEST_F(Expectations, ResponsesAreMeasuredFromTheValuesOwnTimes) {
  const auto judge = responses(50 * ms, 3);
  for (int i = 1; i <= 3; ++i) {
    ask(*judge, i, i * 100 * ms);
    judge->check(table_, {}, i * 100 * ms + ms);  // the same value looked at again is no second request
    answer(*judge, i, i * 100 * ms + i * 10 * ms);
    judge->check(table_, {}, i * 100 * ms + 60 * ms);
  }
  const auto result = judge->result(until(1'000 * ms));
  EXPECT_EQ(result.result, Result::held) << result.detail;
  EXPECT_NE(result.detail.find("3 requests, 0 unanswered, 0 late, slowest 30.00 ms"), std::string::npos)
      << result.detail;
  const auto times = judge->response_times(1'000 * ms);
  ASSERT_TRUE(times);
  EXPECT_EQ(times->samples_ns, (std::vector<std::int64_t>{10 * ms, 20 * ms, 30 * ms}));
  EXPECT_EQ(times->limit_ns, 50 * ms);
  EXPECT_EQ(times->unanswered, 0U);
}

TEST_F(Expectations, AnAnswerAtTheLimitIsInTimeAndOneAfterItIsLate) {
  const auto judge = responses(50 * ms);
  ask(*judge, 1, 0);
  answer(*judge, 1, 50 * ms);
  EXPECT_EQ(judge->result(until(1'000 * ms)).result, Result::held);
  ask(*judge, 2, 100 * ms);
  answer(*judge, 2, 150 * ms + 1);
  const auto result = judge->result(until(1'000 * ms));
  EXPECT_EQ(result.result, Result::failed);
  EXPECT_EQ(result.first_failure_ns, 150 * ms);
  EXPECT_NE(result.detail.find("2 requests, 0 unanswered, 1 late"), std::string::npos) << result.detail;
}

TEST_F(Expectations, AnUnansweredRequestFailsWhenItsTimeIsOver) {
  const auto judge = responses(50 * ms);
  ask(*judge, 1, 0);
  answer(*judge, 1, 10 * ms);
  ask(*judge, 2, 100 * ms);
  EXPECT_EQ(judge->result(until(149 * ms)).result, Result::held) << "the end leaves it less than its time";
  const auto result = judge->result(until(150 * ms));
  EXPECT_EQ(result.result, Result::failed);
  EXPECT_EQ(result.first_failure_ns, 150 * ms);
  EXPECT_EQ(judge->response_times(150 * ms)->unanswered, 1U);
  EXPECT_EQ(judge->response_times(149 * ms)->unanswered, 0U);
}

TEST_F(Expectations, AnAnswerToTheWrongValueIsNone) {
  const auto judge = responses(50 * ms);
  ask(*judge, 1, 0);
  answer(*judge, 7, 10 * ms);
  EXPECT_EQ(judge->result(until(1'000 * ms)).result, Result::failed);
  EXPECT_TRUE(judge->response_times(1'000 * ms)->samples_ns.empty());
}

TEST_F(Expectations, AnAnswerPassesOverOlderRequests) {
  const auto judge = responses(50 * ms);
  ask(*judge, 1, 0);
  ask(*judge, 2, 10 * ms);
  ask(*judge, 3, 20 * ms);
  answer(*judge, 3, 25 * ms);
  answer(*judge, 1, 26 * ms);  // out of order: too late for it to count
  answer(*judge, 2, 27 * ms);
  const auto result = judge->result(until(1'000 * ms));
  EXPECT_EQ(result.result, Result::failed);
  EXPECT_NE(result.detail.find("3 requests, 2 unanswered"), std::string::npos) << result.detail;
  EXPECT_EQ(result.first_failure_ns, 50 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->samples_ns, (std::vector<std::int64_t>{5 * ms}));
}

TEST_F(Expectations, ACounterThatComesRoundIsANewRequest) {
  const auto judge = responses(50 * ms);
  for (int i = 1; i <= 100; ++i) {
    ask(*judge, i % 16, i * 10 * ms);
    answer(*judge, i % 16, i * 10 * ms + 2 * ms);
  }
  const auto result = judge->result(until(2'000 * ms));
  EXPECT_EQ(result.result, Result::held) << result.detail;
  EXPECT_NE(result.detail.find("100 requests, 0 unanswered, 0 late, slowest 2.00 ms"), std::string::npos);
}

TEST_F(Expectations, OfTwoRequestsWithOneValueTheOlderIsAnsweredFirst) {
  const auto judge = responses(50 * ms);
  ask(*judge, 3, 0);
  ask(*judge, 4, 5 * ms);
  ask(*judge, 3, 10 * ms);
  answer(*judge, 3, 12 * ms);
  answer(*judge, 4, 13 * ms);
  answer(*judge, 3, 15 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->samples_ns,
            (std::vector<std::int64_t>{12 * ms, 8 * ms, 5 * ms}));
}

TEST_F(Expectations, AValueThatIsWrittenAgainIsNoRequestAndNoAnswer) {
  const auto judge = responses(50 * ms);
  ask(*judge, 0, 0);  // as it was before the first tick
  ask(*judge, 1, 10 * ms);
  answer(*judge, 1, 12 * ms);
  for (int i = 2; i < 20; ++i) {
    ask(*judge, 1, i * 10 * ms);
    answer(*judge, 1, i * 10 * ms + 5 * ms);
  }
  const auto result = judge->result(until(1'000 * ms));
  EXPECT_EQ(result.result, Result::held) << result.detail;
  EXPECT_NE(result.detail.find("1 requests, 0 unanswered, 0 late, slowest 2.00 ms"), std::string::npos)
      << result.detail;
}

TEST_F(Expectations, ASignalThatIsFreshAgainWithItsOldValueHasNotChanged) {
  const auto judge = responses(50 * ms);
  ask(*judge, 1, 10 * ms);
  answer(*judge, 1, 12 * ms);
  table_.write(request_, {.value = 0.0, .time_ns = 100 * ms, .fresh = false});
  judge->check(table_, {}, 100 * ms);
  ask(*judge, 1, 200 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->unanswered, 0U);
  ask(*judge, 2, 300 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->unanswered, 1U);
}

/// Both are latched in one tick: a repeated answer to an old request, and a new request of the same value.
TEST_F(Expectations, WhatCameBeforeARequestIsNoAnswerToIt) {
  const auto judge = responses(50 * ms);
  table_.write(request_, 3.0, 100 * ms);
  table_.write(reply_, 3.0, 99 * ms);
  judge->check(table_, {}, 101 * ms);
  EXPECT_TRUE(judge->response_times(120 * ms)->samples_ns.empty());
  answer(*judge, 4, 105 * ms);
  answer(*judge, 3, 110 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->samples_ns, (std::vector<std::int64_t>{10 * ms}));
}

TEST_F(Expectations, TooFewRequestsProveNothingHoweverWellTheyWereAnswered) {
  const auto judge = responses(50 * ms, 3);
  for (int i = 1; i <= 2; ++i) {
    ask(*judge, i, i * 100 * ms);
    answer(*judge, i, i * 100 * ms + ms);
  }
  const auto result = judge->result(until(1'000 * ms));
  EXPECT_EQ(result.result, Result::not_checked);
  EXPECT_NE(result.detail.find("only 2 requests"), std::string::npos) << result.detail;
  EXPECT_NE(result.detail.find("at least 3"), std::string::npos) << result.detail;
}

TEST_F(Expectations, ValuesThatAreNotFreshAreNoRequestsAndNoAnswers) {
  const auto judge = responses(50 * ms);
  table_.write(request_, {.value = 1.0, .time_ns = 0, .fresh = false});
  judge->check(table_, {}, 0);
  ask(*judge, 2, 100 * ms);
  table_.write(reply_, {.value = 2.0, .time_ns = 110 * ms, .fresh = false});
  judge->check(table_, {}, 110 * ms);
  const auto result = judge->result(until(1'000 * ms));
  EXPECT_EQ(result.result, Result::failed);
  EXPECT_NE(result.detail.find("1 requests, 1 unanswered"), std::string::npos) << result.detail;
}

/// A limit that lets many requests wait at once.
TEST_F(Expectations, ManyRequestsMayWaitAtOnce) {
  const auto judge = responses(10'000 * ms, 1, 2'000);
  for (int i = 0; i < 600; ++i)
    ask(*judge, i + 1, i * 10 * ms);
  for (int i = 0; i < 600; ++i)
    answer(*judge, i + 1, 6'000 * ms + i * ms);
  const auto result = judge->result(until(60'000 * ms));
  EXPECT_EQ(result.result, Result::held) << result.detail;
  EXPECT_EQ(judge->response_times(60'000 * ms)->samples_ns.size(), 600U);
}

TEST_F(Expectations, LookingDoesNotAllocate) {
  const auto never = judge(config::Never{condition("ego.speed > 14 or bus.Header.Counter < 0")});
  const auto eventually = judge(config::Eventually{condition("ego.speed > 14"), std::nullopt});
  const auto answers = responses(50 * ms, 1, 300);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int i = 0; i < 1'000; ++i) {
    look(*never, i % 20, i * ms);
    look(*eventually, i % 20, i * ms);
    ask(*answers, i, i * ms);
    if (i % 3 != 0) answer(*answers, i - 1, i * ms);
  }
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_EQ(never->result(until(2'000 * ms)).result, Result::failed);
  EXPECT_EQ(eventually->result(until(2'000 * ms)).result, Result::held);
}

TEST_F(Expectations, OfALongRunTheFirstMillionTimesAreKeptAndTheReportSaysSo) {
  constexpr std::uint64_t ticks_of_a_week = 604'800'000;
  constexpr std::int64_t answers = 1'000'001;
  const auto claim = responses(50 * ms, 1, ticks_of_a_week);
  for (std::int64_t i = 0; i < answers; ++i) {
    ask(*claim, static_cast<double>(i % 1000 + 1), i * ms);
    answer(*claim, static_cast<double>(i % 1000 + 1), i * ms + (i + 1 == answers ? 60 * ms : 1));
  }
  const auto result = claim->result(until(answers * ms));
  EXPECT_EQ(result.result, Result::failed) << "the last one was late";
  EXPECT_EQ(
      result.detail,
      "bus.Header.Counter answered by bus.Command.AnswerTo within 50.00 ms: 1000001 requests, 0 unanswered, "
      "1 late, slowest 60.00 ms (the list of times has the first 1000000)");
  const auto times = claim->response_times(answers * ms);
  ASSERT_TRUE(times);
  EXPECT_EQ(times->samples_ns.size(), 1'000'000U);
  EXPECT_EQ(times->name, "claim (the first 1000000 answers)");
}

}  // namespace
}  // namespace hil::run
