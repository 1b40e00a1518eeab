// Expectations over received signals, which are unknown while they are not fresh.

#include <gtest/gtest.h>

#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

/// Received signals: of a message with a time-out of 100 ms and of one without a time-out; and whether the
/// bus is connected.
class ReceivedSignals : public Expectations {
 protected:
  const signals::SignalId mode_ = table_.add({.name = "can.car.Status.Mode",
                                              .unit = "",
                                              .writer = "can.car",
                                              .arrives = true,
                                              .timeout_ns = 100 * ms});
  const signals::SignalId rare_ =
      table_.add({.name = "can.car.Key.State", .unit = "", .writer = "can.car", .arrives = true});
  const signals::SignalId answer_ = table_.add({.name = "can.car.Reply.Value",
                                                .unit = "",
                                                .writer = "can.car",
                                                .arrives = true,
                                                .timeout_ns = 100 * ms});
  const signals::SignalId connected_ =
      table_.add({.name = "can.car.connected", .unit = "", .writer = "can.car"});
  const signals::SignalId fresh_ =
      table_.add({.name = "can.car.Status.fresh", .unit = "", .writer = "can.car"});

  void receive(signals::SignalId signal, double value, bool fresh, std::int64_t time_ns) {
    table_.write(signal, {.value = value, .time_ns = time_ns, .fresh = fresh});
  }
  /// Ticks of 1 ms with the mode as given.
  void run(Judge& judge, double mode, bool fresh, std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t time = from_ms; time < to_ms; ++time) {
      receive(mode_, mode, fresh, time * ms);
      table_.write(fresh_, fresh ? 1.0 : 0.0, time * ms);
      judge.check(table_, {.time_ns = time * ms});
    }
  }
};

TEST_F(ReceivedSignals, ThatNeverArrivedAreNotChecked) {
  const auto always = judge(Always{condition("can.car.Status.Mode == 0")});
  run(*always, 0.0, false, 0, 1'000);
  const auto result = expect(
      *always, until(1'000 * ms, 1'000), Result::not_checked,
      {"evaluated on none of 1000 ticks", "can.car.Status.Mode was not fresh from 0.000 s to 0.999 s"});
  EXPECT_EQ(result.evaluated_ticks, 0U);
  EXPECT_EQ(result.covered_ticks, 1'000U);
}

TEST_F(ReceivedSignals, MayBeMissingForTheirTimeOutAndNoLonger) {
  const auto always = judge(Always{condition("can.car.Status.Mode == 1")});
  run(*always, 1.0, true, 0, 5'000);
  run(*always, 0.0, false, 5'000, 5'101);
  run(*always, 1.0, true, 5'101, 10'000);
  expect(*always, until(10'000 * ms, 10'000), Result::held);
  run(*always, 0.0, false, 10'000, 10'102);
  run(*always, 1.0, true, 10'102, 20'000);
  expect(*always, until(20'000 * ms, 20'000), Result::not_checked,
         {"can.car.Status.Mode was not fresh from 10.000 s to 10.101 s, longer than its time-out "
          "of 0.100 s"});
}

TEST_F(ReceivedSignals, DoNotHideAFailure) {
  const auto always = judge(Always{condition("can.car.Status.Mode == 1")});
  run(*always, 2.0, true, 0, 1);
  run(*always, 0.0, false, 1, 1'000);
  expect(*always, until(1'000 * ms, 1'000), Result::failed);
}

TEST_F(ReceivedSignals, MatterOnlyWhereTheyDecide) {
  const auto guarded = judge(Always{condition("can.car.Status.fresh == 0 or can.car.Status.Mode == 1")});
  const auto settled = judge(Never{condition("ego.speed > 14 and can.car.Status.Mode == 1")});
  table_.write(speed_, 3.0, 0);
  run(*guarded, 0.0, false, 0, 1'000);
  run(*settled, 0.0, false, 0, 1'000);
  expect(*guarded, until(1'000 * ms, 1'000), Result::held);
  expect(*settled, until(1'000 * ms, 1'000), Result::held);
}

TEST_F(ReceivedSignals, CoverageIsAShareOfAllTicks) {
  const auto never = judge(Never{condition("ego.speed > 14")});
  for (std::int64_t time = 0; time < 950; ++time)
    set_speed(*never, 3.0, time * ms);
  expect(*never, until(1'000 * ms, 1'000), Result::held);
  expect(*never, until(1'000 * ms, 1'001), Result::not_checked, {"evaluated on 950 of 1001 ticks (94.9 %)"});
}

TEST_F(ReceivedSignals, CoverageZeroStillRequiresOneTick) {
  config::Expectation expectation{
      .name = "lights", .place = {}, .claim = claim_of(Never{condition("can.car.Status.Mode == 1")})};
  expectation.coverage = 0.0;
  const auto never = judge_of_expectation(expectation, 10);
  run(*never, 0.0, false, 0, 50);
  expect(*never, until(50 * ms, 50), Result::not_checked);
  run(*never, 0.0, true, 50, 51);
  expect(*never, until(51 * ms, 51), Result::held);
}

TEST_F(ReceivedSignals, EventuallyIsHeldByOneTick) {
  const auto met = judge(Eventually{condition("can.car.Status.Mode == 1"), std::nullopt});
  run(*met, 1.0, true, 0, 1);
  run(*met, 0.0, false, 1, 1'000);
  expect(*met, until(1'000 * ms, 1'000), Result::held);
  const auto missed = judge(Eventually{condition("can.car.Status.Mode == 1"), std::nullopt});
  run(*missed, 0.0, false, 0, 1'000);
  const auto result = expect(*missed, until(1'000 * ms, 1'000), Result::not_checked);
  EXPECT_FALSE(result.first_failure_ns);
}

TEST_F(ReceivedSignals, EventuallyByATimeCoversTheTicksUpToIt) {
  const auto claim = judge(Eventually{condition("can.car.Status.Mode == 1"), 99 * ms});
  run(*claim, 0.0, true, 0, 100);
  run(*claim, 0.0, false, 100, 1'000);
  const auto result = expect(*claim, until(1'000 * ms, 1'000), Result::failed);
  EXPECT_EQ(result.covered_ticks, 100U);
}

TEST_F(ReceivedSignals, RequestThatNeverArrivesIsNotChecked) {
  const auto claim = judge(Response{
      .request = {"can.car.Key.State", {}}, .reply = {"can.car.Reply.Value", {}}, .within_ns = 50 * ms});
  run(*claim, 0.0, true, 0, 1'000);
  expect(*claim, until(1'000 * ms, 1'000), Result::not_checked, {"only 0 requests"});
}

TEST_F(ReceivedSignals, RequestsWithoutTheReplyingBusAreCountedSeparately) {
  const auto claim = judge(
      Response{.request = {"ego.speed", {}}, .reply = {"can.car.Reply.Value", {}}, .within_ns = 50 * ms});
  table_.write(connected_, 1.0, 0);
  for (int i = 1; i <= 40; ++i) {
    set_speed(*claim, i, i * 100 * ms);
    receive(answer_, i, true, i * 100 * ms + 10 * ms);
    claim->check(table_, {.time_ns = i * 100 * ms + 10 * ms});
  }
  set_speed(*claim, 41, 4'100 * ms);
  table_.write(connected_, 0.0, 4'120 * ms);
  claim->check(table_, {.time_ns = 4'120 * ms});
  table_.write(connected_, 1.0, 4'300 * ms);
  claim->check(table_, {.time_ns = 4'300 * ms});
  set_speed(*claim, 42, 4'980 * ms);
  expect(*claim, {5'000 * ms, 1, ms}, Result::held,
         {"40 requests, 0 unanswered",
          "1 further request not judged, since the replying device was not connected",
          "1 further request not judged, since the run or the window ended before their time limit"});
  EXPECT_EQ(claim->response_times(5'000 * ms)->not_judged, 2U);
}

TEST_F(ReceivedSignals, TooFewJudgedRequestsAreNotChecked) {
  const auto claim = judge(
      Response{.request = {"ego.speed", {}}, .reply = {"can.car.Reply.Value", {}}, .within_ns = 50 * ms});
  table_.write(connected_, 1.0, 0);
  set_speed(*claim, 1, 100 * ms);
  receive(answer_, 1, true, 110 * ms);
  claim->check(table_, {.time_ns = 110 * ms});
  table_.write(connected_, 0.0, 190 * ms);
  for (int i = 2; i <= 9; ++i)
    set_speed(*claim, i, i * 100 * ms);
  expect(*claim, {2'000 * ms, 1, ms}, Result::not_checked,
         {"judged 1 of 9 requests (11.1 %), less than its coverage of 95 %"});
}

}  // namespace
}  // namespace hil::expectations
