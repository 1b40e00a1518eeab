#include "runtime/expectations/every_tick.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

TEST_F(Expectations, NeverFailsAtTheFirstTickThatBreaksIt) {
  const auto never = judge(Never{condition("ego.speed > 14")});
  set_speed(*never, 14.0, 0);
  set_speed(*never, 3.0, ms);
  expect(*never, until(2 * ms), Result::held);
  EXPECT_EQ(never->result(until(2 * ms)).detail, "never ego.speed > 14: held for 2 ticks");
  EXPECT_FALSE(never->result(until(2 * ms)).first_failure_ns);
  set_speed(*never, 14.5, 2 * ms);
  set_speed(*never, 0.0, 3 * ms);
  set_speed(*never, 20.0, 4 * ms);
  const auto result = expect(*never, until(5 * ms), Result::failed);
  EXPECT_EQ(result.name, "claim");
  EXPECT_EQ(result.first_failure_ns, 2 * ms);
  EXPECT_EQ(result.detail, "never ego.speed > 14: broken at 0.002 s");
  EXPECT_FALSE(never->response_times(5 * ms));
}

TEST_F(Expectations, AlwaysFailsAtTheFirstTickWithoutIt) {
  const auto always = judge(Always{condition("ego.speed >= 0")});
  set_speed(*always, 0.0, 0);
  expect(*always, until(ms), Result::held);
  set_speed(*always, -0.001, ms);
  expect(*always, until(2 * ms), Result::failed);
  EXPECT_EQ(always->result(until(2 * ms)).first_failure_ns, ms);
}

/// Comparisons with it are false, which would hold each claim that something never happens.
TEST_F(Expectations, SignalThatIsNoNumberIsUnknown) {
  const auto never = judge(Never{condition("ego.speed > 14")});
  set_speed(*never, std::numeric_limits<double>::quiet_NaN(), 0);
  set_speed(*never, std::numeric_limits<double>::quiet_NaN(), ms);
  expect(*never, until(2 * ms, 2), Result::not_checked);
  set_speed(*never, 20.0, 2 * ms);
  expect(*never, until(3 * ms, 3), Result::failed);
}

TEST_F(Expectations, RunWithoutATickChecksNothing) {
  const auto is_not_checked = [](const std::unique_ptr<Judge>& judge) {
    return judge->result(until(0, 0)).result == Result::not_checked;
  };
  EXPECT_TRUE(is_not_checked(judge(Never{condition("ego.speed > 14")})));
  EXPECT_TRUE(is_not_checked(judge(Always{condition("ego.speed >= 0")})));
  EXPECT_TRUE(is_not_checked(judge(Eventually{condition("ego.speed == 0"), std::nullopt})));
  EXPECT_TRUE(is_not_checked(responses(50 * ms)));
}

TEST_F(Expectations, EventuallyIsHeldByOneTick) {
  const auto eventually = judge(Eventually{condition("ego.speed == 0"), std::nullopt});
  set_speed(*eventually, 5.0, 0);
  expect(*eventually, until(ms), Result::failed);
  set_speed(*eventually, 0.0, 7 * ms);
  set_speed(*eventually, 5.0, 8 * ms);
  expect(*eventually, until(9 * ms), Result::held);
  EXPECT_EQ(eventually->result(until(9 * ms)).detail, "eventually ego.speed == 0: at 0.007 s");
  EXPECT_EQ(eventually->result(until(9 * ms)).met_ns, 7 * ms);
}

TEST_F(Expectations, EventuallyHasATimeLimit) {
  const auto in_time = judge(Eventually{condition("ego.speed == 0"), 5 * ms});
  set_speed(*in_time, 0.0, 5 * ms);
  expect(*in_time, until(9 * ms), Result::held);
  const auto late = judge(Eventually{condition("ego.speed == 0"), 5 * ms});
  set_speed(*late, 5.0, 0);
  set_speed(*late, 0.0, 6 * ms);
  const auto result = expect(*late, until(9 * ms), Result::failed, {"only at 0.006 s, required by 0.005 s"});
  EXPECT_EQ(result.first_failure_ns, 5 * ms);
}

TEST_F(Expectations, EventuallyFailsAtTheEndOfAnInterruptedRun) {
  const auto eventually = judge(Eventually{condition("ego.speed == 0"), 9'000 * ms});
  set_speed(*eventually, 5.0, 0);
  const auto result = expect(*eventually, until(3'000 * ms), Result::failed);
  EXPECT_EQ(result.first_failure_ns, 3'000 * ms);
  EXPECT_EQ(result.detail, "eventually ego.speed == 0: not in 3.000 s");
}

TEST_F(Expectations, EventuallyThatIsNeverTrueHasTheMarginAtWhichItCameNearest) {
  const auto judge = this->judge(Eventually{condition("ego.speed >= 10"), 5 * ms});
  for (const int tick : {0, 1, 2, 3, 4, 5, 6})
    set_speed(*judge, tick == 3 ? 9.5 : tick == 6 ? 9.9 : 1.0, tick * ms);
  const auto near = expect(*judge, until(9 * ms, 9), Result::failed, {"not in 0.005 s, nearest at 0.003 s"});
  EXPECT_DOUBLE_EQ(near.margin, -0.5);
  EXPECT_EQ(near.margin_unit, "m/s");
  EXPECT_EQ(near.worst_ns, 3 * ms);
  const auto short_time = this->judge(Eventually{condition("duration(ego.speed > 5) >= 4 ms"), std::nullopt});
  for (const int tick : {0, 1, 2, 3, 4, 5, 6})
    set_speed(*short_time, tick >= 1 && tick <= 4 ? 9.0 : 0.0, tick * ms);
  EXPECT_NEAR(short_time->result(until(7 * ms, 7)).margin, -0.001, 1e-12) << "3 ms of 4 ms";
}

TEST_F(Expectations, ConditionReadsTheValuesOfItsSignals) {
  const auto never = judge(Never{condition("ego.speed > 14 and bus.Header.Counter == 2")});
  table_.write(request_, 1.0, 0);
  table_.write(reply_, 2.0, 0);
  set_speed(*never, 20.0, 0);
  expect(*never, until(ms), Result::held);
  table_.write(request_, 2.0, ms);
  set_speed(*never, 20.0, ms);
  expect(*never, until(2 * ms), Result::failed);
}

TEST_F(Expectations, ListTheFirstIntervalsThatWereNotEvaluated) {
  const auto never = judge(Never{condition("ego.speed > 14")});
  for (int tick = 0; tick < 100; ++tick)
    set_speed(*never, tick % 4 < 2 ? 1.0 : std::nan(""), tick * ms);
  const report::Expectation result = never->result(until(100 * ms, 100));
  ASSERT_EQ(result.not_evaluated.size(), Coverage::max_intervals);
  for (std::size_t i = 0; i < result.not_evaluated.size(); ++i) {
    const report::NotEvaluated& interval = result.not_evaluated[i];
    EXPECT_EQ(interval.begin_ns, static_cast<std::int64_t>(4 * i + 2) * ms);
    EXPECT_EQ(interval.end_ns, interval.begin_ns + ms);
    EXPECT_EQ(interval.signals, std::vector<std::string>{"ego.speed"});
  }
}

TEST_F(Expectations, ResponsesAreMeasuredByTheTimesOfTheValues) {
  const auto judge = responses(50 * ms, 3);
  for (int i = 1; i <= 3; ++i) {
    request(*judge, i, i * 100 * ms);
    judge->check(table_, {.time_ns = i * 100 * ms + ms});  // an unchanged value is no second request
    reply(*judge, i, i * 100 * ms + i * 10 * ms);
    judge->check(table_, {.time_ns = i * 100 * ms + 60 * ms});
  }
  expect(*judge, until(1'000 * ms), Result::held, {"3 requests, 0 unanswered, 0 late, slowest 30.00 ms"});
  const auto times = judge->response_times(1'000 * ms);
  ASSERT_TRUE(times);
  EXPECT_EQ(times->samples_ns, (std::vector<std::int64_t>{10 * ms, 20 * ms, 30 * ms}));
  EXPECT_EQ(times->limit_ns, 50 * ms);
  EXPECT_EQ(times->unanswered, 0U);
}

TEST_F(Expectations, ReplyAtTheLimitIsInTimeAndOneAfterItIsLate) {
  const auto judge = responses(50 * ms);
  request(*judge, 1, 0);
  reply(*judge, 1, 50 * ms);
  expect(*judge, until(1'000 * ms), Result::held);
  request(*judge, 2, 100 * ms);
  reply(*judge, 2, 150 * ms + 1);
  const auto result = expect(*judge, until(1'000 * ms), Result::failed, {"2 requests, 0 unanswered, 1 late"});
  EXPECT_EQ(result.first_failure_ns, 150 * ms);
}

TEST_F(Expectations, UnansweredRequestFailsAtItsTimeLimit) {
  const auto judge = responses(50 * ms);
  request(*judge, 1, 0);
  reply(*judge, 1, 10 * ms);
  request(*judge, 2, 100 * ms);
  // A reply at 150 ms would be in time, and the run does not see it when it ends there.
  expect(*judge, until(150 * ms), Result::held);
  const auto result = expect(*judge, until(150 * ms + 1), Result::failed);
  EXPECT_EQ(result.first_failure_ns, 150 * ms);
  EXPECT_EQ(judge->response_times(150 * ms + 1)->unanswered, 1U);
  EXPECT_EQ(judge->response_times(150 * ms)->unanswered, 0U);
}

TEST_F(Expectations, ReplyWithAnotherValueDoesNotCount) {
  const auto judge = responses(50 * ms);
  request(*judge, 1, 0);
  reply(*judge, 7, 10 * ms);
  expect(*judge, until(1'000 * ms), Result::failed);
  EXPECT_TRUE(judge->response_times(1'000 * ms)->samples_ns.empty());
}

TEST_F(Expectations, ReplySkipsOlderRequests) {
  const auto judge = responses(50 * ms);
  request(*judge, 1, 0);
  request(*judge, 2, 10 * ms);
  request(*judge, 3, 20 * ms);
  reply(*judge, 3, 25 * ms);
  reply(*judge, 1, 26 * ms);  // out of order, so it does not count
  reply(*judge, 2, 27 * ms);
  const auto result = expect(*judge, until(1'000 * ms), Result::failed, {"3 requests, 2 unanswered"});
  EXPECT_EQ(result.first_failure_ns, 50 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->samples_ns, (std::vector<std::int64_t>{5 * ms}));
}

TEST_F(Expectations, CounterThatWrapsIsANewRequest) {
  const auto judge = responses(50 * ms);
  for (int i = 1; i <= 100; ++i) {
    request(*judge, i % 16, i * 10 * ms);
    reply(*judge, i % 16, i * 10 * ms + 2 * ms);
  }
  expect(*judge, until(2'000 * ms), Result::held, {"100 requests, 0 unanswered, 0 late, slowest 2.00 ms"});
}

TEST_F(Expectations, OldestRequestOfAValueIsAnsweredFirst) {
  const auto judge = responses(50 * ms);
  request(*judge, 3, 0);
  request(*judge, 4, 5 * ms);
  request(*judge, 3, 10 * ms);
  reply(*judge, 3, 12 * ms);
  reply(*judge, 4, 13 * ms);
  reply(*judge, 3, 15 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->samples_ns,
            (std::vector<std::int64_t>{12 * ms, 8 * ms, 5 * ms}));
}

TEST_F(Expectations, RepeatedValueIsNeitherRequestNorReply) {
  const auto judge = responses(50 * ms);
  request(*judge, 0, 0);  // the value before the first tick
  request(*judge, 1, 10 * ms);
  reply(*judge, 1, 12 * ms);
  for (int i = 2; i < 20; ++i) {
    request(*judge, 1, i * 10 * ms);
    reply(*judge, 1, i * 10 * ms + 5 * ms);
  }
  expect(*judge, until(1'000 * ms), Result::held, {"1 requests, 0 unanswered, 0 late, slowest 2.00 ms"});
}

TEST_F(Expectations, UnchangedValueThatIsFreshAgainIsNoRequest) {
  const auto judge = responses(50 * ms);
  request(*judge, 1, 10 * ms);
  reply(*judge, 1, 12 * ms);
  table_.write(request_, {.value = 0.0, .time_ns = 100 * ms, .fresh = false});
  judge->check(table_, {.time_ns = 100 * ms});
  request(*judge, 1, 200 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->unanswered, 0U);
  request(*judge, 2, 300 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->unanswered, 1U);
}

/// One tick latches a repeated reply to an old request, and a new request of the same value.
TEST_F(Expectations, ReplyBeforeTheRequestDoesNotCount) {
  const auto judge = responses(50 * ms);
  table_.write(request_, 3.0, 100 * ms);
  table_.write(reply_, 3.0, 99 * ms);
  judge->check(table_, {.time_ns = 101 * ms});
  EXPECT_TRUE(judge->response_times(120 * ms)->samples_ns.empty());
  reply(*judge, 4, 105 * ms);
  reply(*judge, 3, 110 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->samples_ns, (std::vector<std::int64_t>{10 * ms}));
}

TEST_F(Expectations, TooFewRequestsAreNotChecked) {
  const auto judge = responses(50 * ms, 3);
  for (int i = 1; i <= 2; ++i) {
    request(*judge, i, i * 100 * ms);
    reply(*judge, i, i * 100 * ms + ms);
  }
  expect(*judge, until(1'000 * ms), Result::not_checked, {"only 2 requests", "at least 3"});
}

TEST_F(Expectations, ValuesThatAreNotFreshAreNeitherRequestsNorReplies) {
  const auto judge = responses(50 * ms);
  table_.write(request_, {.value = 1.0, .time_ns = 0, .fresh = false});
  judge->check(table_, {.time_ns = 0});
  request(*judge, 2, 100 * ms);
  table_.write(reply_, {.value = 2.0, .time_ns = 110 * ms, .fresh = false});
  judge->check(table_, {.time_ns = 110 * ms});
  expect(*judge, until(1'000 * ms), Result::failed, {"1 requests, 1 unanswered"});
}

/// A long time limit, so that many requests are pending at once.
TEST_F(Expectations, ManyRequestsMayBePending) {
  const auto judge = responses(10'000 * ms, 1, 2'000);
  for (int i = 0; i < 600; ++i)
    request(*judge, i + 1, i * 10 * ms);
  for (int i = 0; i < 600; ++i)
    reply(*judge, i + 1, 6'000 * ms + i * ms);
  expect(*judge, until(60'000 * ms), Result::held);
  EXPECT_EQ(judge->response_times(60'000 * ms)->samples_ns.size(), 600U);
}

TEST_F(Expectations, CheckingDoesNotAllocate) {
  const auto never = judge(Never{condition("ego.speed > 14 or bus.Header.Counter < 0")});
  const auto eventually = judge(Eventually{condition("ego.speed > 14"), std::nullopt});
  const auto answers = responses(50 * ms, 1, 300);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int i = 0; i < 1'000; ++i) {
    set_speed(*never, i % 20, i * ms);
    set_speed(*eventually, i % 20, i * ms);
    request(*answers, i, i * ms);
    if (i % 3 != 0) reply(*answers, i - 1, i * ms);
  }
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  expect(*never, until(2'000 * ms), Result::failed);
  expect(*eventually, until(2'000 * ms), Result::held);
}

TEST_F(Expectations, FirstMillionResponseTimesAreKept) {
  constexpr std::uint64_t ticks_of_a_week = 604'800'000;
  constexpr std::int64_t answers = 1'000'001;
  const auto claim = responses(50 * ms, 1, ticks_of_a_week);
  for (std::int64_t i = 0; i < answers; ++i) {
    request(*claim, static_cast<double>(i % 1000 + 1), i * ms);
    reply(*claim, static_cast<double>(i % 1000 + 1), i * ms + (i + 1 == answers ? 60 * ms : 1));
  }
  const auto result = expect(*claim, until(answers * ms), Result::failed);  // the last reply is late
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
}  // namespace hil::expectations
