// Cycle times of messages by the receive time stamps of all their frames.

#include "runtime/expectations/cycle_time.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_expectations/arriving_device.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

constexpr std::int64_t us = 1'000;

class CycleTimes : public Expectations {
 protected:
  CycleTimes() { table_.add({.name = "can.car.Status.fresh", .unit = "", .writer = "can.car"}); }
  const signals::SignalId mode_ =
      table_.add({.name = "can.car.Status.Mode", .unit = "", .writer = "can.car", .arrives = true});
  const signals::SignalId level_ =
      table_.add({.name = "can.car.Status.Level", .unit = "", .writer = "can.car", .arrives = true});

  const signals::Links links_{.inputs = {mode_, level_}, .outputs = {}, .connected = {}, .fresh = {}};

  static CycleTime claim(std::uint64_t at_least = 1) {
    return {
        .message = {"can.car.Status", {}}, .period_ns = 10 * ms, .tolerance_ns = ms, .at_least = at_least};
  }
  /// The newest frame of a tick.
  void frame(Judge& judge, std::int64_t stamp_ns) {
    table_.write(mode_, 1.0, stamp_ns);
    judge.check(table_, {.time_ns = stamp_ns});
  }
};

TEST_F(CycleTimes, AreTheIntervalsOfTheStamps) {
  const auto judge = this->judge(claim());
  for (const std::int64_t stamp_us : {0, 10'000, 19'500, 30'250, 40'250})
    frame(*judge, stamp_us * us);
  const auto result = expect(*judge, until(45 * ms, 45), Result::held);
  EXPECT_EQ(result.detail,
            "cycle time of can.car.Status 10 ms +- 1 ms: 0 of 4 intervals outside, from 9.5 ms to 10.75 ms, "
            "mean 10.1 ms");
  EXPECT_DOUBLE_EQ(result.margin, 0.00025);
  EXPECT_EQ(result.margin_unit, "s");
  EXPECT_EQ(result.worst_ns, 30'250 * us);
}

TEST_F(CycleTimes, OutsideTheToleranceFail) {
  const auto judge = this->judge(claim());
  for (const std::int64_t stamp_us : {0, 10'000, 21'001, 29'000, 39'000})
    frame(*judge, stamp_us * us);
  const auto result = expect(*judge, until(45 * ms, 45), Result::failed, {"2 of 4 intervals outside"});
  EXPECT_EQ(result.first_failure_ns, 21 * ms) << "the frame is missing from there on";
  EXPECT_DOUBLE_EQ(result.margin, -0.001001);
  EXPECT_EQ(result.worst_ns, 29 * ms);
}

TEST_F(CycleTimes, CountEveryFrameOfATick) {
  ArrivingDevice device(2);
  arrivals_.keep(device, links_, mode_);
  arrivals_.keep(device, links_, level_);
  const auto judge = this->judge(claim());
  device.receive(0, 1, -3 * ms);
  device.receive({{0, 1}, {1, 1}}, 0);
  device.receive(0, 1, 10 * ms);  // one of both signals is multiplexed
  device.receive(1, 1, 20 * ms);
  device.receive({{0, 1}, {1, 1}}, 30 * ms);
  tick({judge.get()}, 30 * ms);
  device.receive(0, 1, 41 * ms);
  const std::vector<Judge*> judges{judge.get()};
  allocation_guard::reset();
  allocation_guard::enter_tick();
  tick(judges, 45 * ms);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  const auto result = expect(*judge, until(45 * ms, 45), Result::held, {"0 of 4 intervals outside"});
  EXPECT_DOUBLE_EQ(result.margin, 0.0);
  EXPECT_EQ(result.worst_ns, 41 * ms);
  device.lose(2);
  expect(*judge, until(45 * ms, 45), Result::not_checked, {"2 frames were lost"});
}

TEST_F(CycleTimes, CountFramesWithOneStamp) {
  ArrivingDevice device(2);
  arrivals_.keep(device, links_, mode_);
  arrivals_.keep(device, links_, level_);
  const auto judge = this->judge(claim());
  for (const std::int64_t stamp_ms : {0, 10, 10, 20})
    device.receive({{0, 1}, {1, 1}}, stamp_ms * ms);
  tick({judge.get()}, 20 * ms);
  const auto result = expect(*judge, until(20 * ms, 20), Result::failed, {"1 of 3 intervals outside"});
  EXPECT_DOUBLE_EQ(result.margin, -0.009);
  EXPECT_EQ(result.first_failure_ns, 10 * ms);
}

TEST_F(CycleTimes, OfAMessageThatStopsFail) {
  const auto judge = this->judge(claim());
  frame(*judge, 0);
  frame(*judge, 10 * ms);
  expect(*judge, until(21 * ms, 21), Result::held);
  const auto result = expect(*judge, until(50 * ms, 50), Result::failed, {"1 of 2 intervals outside"});
  EXPECT_EQ(result.first_failure_ns, 21 * ms);
  EXPECT_DOUBLE_EQ(result.margin, -0.029);
}

TEST_F(CycleTimes, WithoutAnIntervalAreNotChecked) {
  const auto judge = this->judge(claim(2));
  judge->check(table_, {.time_ns = 0});
  auto result = expect(*judge, until(5 * ms, 5), Result::not_checked, {"at least 2 have to be judged"});
  EXPECT_TRUE(std::isnan(result.margin));
  frame(*judge, 6 * ms);
  frame(*judge, 16 * ms);
  expect(*judge, until(20 * ms, 20), Result::not_checked, {"0 of 1 interval outside", "at least 2"});
}

TEST_F(CycleTimes, InAWindowLieBetweenTwoOfItsFrames) {
  const auto judge =
      windowed(claim(), {.place = {}, .from_ns = 15 * ms, .to_ns = 45 * ms, .after = {}, .until = {}});
  for (const std::int64_t stamp_ms : {0, 3, 20, 30, 40, 52, 60})
    frame(*judge, stamp_ms * ms);
  expect(*judge, until(70 * ms, 70), Result::held, {"0 of 2 intervals outside"});
}

}  // namespace
}  // namespace hil::expectations
