// Windows: the ticks on which an expectation is judged.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

class Windows : public Expectations {
 protected:
  static config::WindowSection between(std::int64_t from_ms, std::int64_t to_ms) {
    return {.place = {}, .from_ns = from_ms * ms, .to_ns = to_ms * ms, .after = {}, .until = {}};
  }
  /// Ticks of 1 ms from 0 on with these speeds.
  void run(Judge& judge, std::initializer_list<double> speeds) {
    std::int64_t time_ns = 0;
    for (const double speed : speeds) {
      set_speed(judge, speed, time_ns);
      time_ns += ms;
    }
  }
};

TEST_F(Windows, BothLimitsBelongToIt) {
  const auto judge = windowed(Never{condition("ego.speed > 5")}, between(2, 4));
  run(*judge, {9, 9, 1, 4, 2, 9, 9});
  const auto result = expect(*judge, until(7 * ms, 7), Result::held);
  EXPECT_EQ(result.detail, "never ego.speed > 5: held for 3 ticks; in the window from 0.002 s to 0.004 s");
  EXPECT_EQ(result.covered_ticks, 3U);
  EXPECT_EQ(result.margin, 1.0);
  EXPECT_EQ(result.worst_ns, 3 * ms);
  for (const double late : {2, 4}) {
    const auto broken = windowed(Never{condition("ego.speed > 5")}, between(2, 4));
    for (int tick = 0; tick < 7; ++tick)
      set_speed(*broken, tick == late ? 9 : 0, tick * ms);
    EXPECT_EQ(expect(*broken, until(7 * ms, 7), Result::failed).first_failure_ns,
              static_cast<std::int64_t>(late) * ms);
  }
}

TEST_F(Windows, OpensWithItsConditionAndClosesForGood) {
  config::WindowSection window{.place = {},
                               .from_ns = {},
                               .to_ns = {},
                               .after = condition("bus.Header.Counter == 1"),
                               .until = condition("bus.Header.Counter == 2")};
  const auto judge = windowed(Always{condition("ego.speed > 5")}, window);
  int tick = 0;
  for (const auto& [counter, speed] :
       {std::pair{2, 0.0}, {0, 0.0}, {1, 8.0}, {0, 7.0}, {2, 0.0}, {1, 0.0}, {0, 0.0}}) {
    table_.write(request_, counter, tick * ms);
    set_speed(*judge, speed, tick++ * ms);
  }
  const auto result = expect(*judge, until(7 * ms, 7), Result::held);
  EXPECT_EQ(result.detail, "always ego.speed > 5: held for 2 ticks; in the window from 0.002 s to 0.004 s");
  EXPECT_EQ(result.covered_ticks, 2U);
  EXPECT_EQ(result.margin, 2.0);
}

TEST_F(Windows, ThatDoesNotOpenIsNotChecked) {
  const config::WindowSection after{
      .place = {}, .from_ns = {}, .to_ns = {}, .after = condition("bus.Header.Counter == 1"), .until = {}};
  const auto waiting = windowed(Never{condition("ego.speed > 5")}, after);
  run(*waiting, {9, 9, 9});
  auto result = expect(*waiting, until(3 * ms, 3), Result::not_checked);
  EXPECT_EQ(result.detail, "its window did not open: 'bus.Header.Counter == 1' was not true");
  EXPECT_TRUE(std::isnan(result.margin));
  const auto late = windowed(Never{condition("ego.speed > 5")}, between(5, 9));
  run(*late, {9, 9, 9});
  result = expect(*late, until(3 * ms, 10), Result::not_checked);
  EXPECT_EQ(result.detail, "its window did not open: the run ended at 0.003 s, before 0.005 s");
}

TEST_F(Windows, FunctionsKeepTheirMemoryBeforeThem) {
  const auto judge = windowed(Always{condition("duration(ego.speed > 5) >= 2 ms")}, between(3, 5));
  run(*judge, {0, 9, 9, 9, 9, 9});
  expect(*judge, until(6 * ms, 6), Result::held);
}

TEST_F(Windows, CountAndReactionsBeginInThem) {
  const auto count = windowed(Count{condition("ego.speed > 5"), 1, 1}, between(2, 6));
  run(*count, {9, 9, 9, 0, 9, 9, 9, 0, 9});
  expect(*count, until(9 * ms, 9), Result::held, {"became true 1 time, last at 0.004 s"});
  const auto reaction =
      windowed(Reaction{condition("ego.speed > 5"), condition("ego.speed < 1"), 2 * ms}, between(2, 6));
  run(*reaction, {9, 9, 0, 9, 0, 9, 9, 0});
  // The second one is open at the end of the window, whose ticks from there on are not evaluated.
  expect(*reaction, until(8 * ms, 8), Result::not_checked,
         {"1 of 1 reaction in time", "1 not judged, since the run or the window ended before",
          "evaluated on 3 of 5 ticks"});
}

TEST_F(Windows, ResponsesAreToTheRequestsInThem) {
  const Response claim{
      .request = {"bus.Header.Counter", {}}, .reply = {"bus.Command.AnswerTo", {}}, .within_ns = 5 * ms};
  const auto judge = windowed(claim, between(10, 30));
  request(*judge, 1, 2 * ms);  // before it, without a reply
  request(*judge, 2, 12 * ms);
  reply(*judge, 2, 15 * ms);
  request(*judge, 3, 28 * ms);  // its reply would be in time after the window
  reply(*judge, 3, 31 * ms);
  request(*judge, 4, 35 * ms);
  const auto result = expect(*judge, until(100 * ms, 3), Result::not_checked,
                             {"1 requests, 0 unanswered, 0 late, slowest 3.00 ms",
                              "1 further request not judged, since the run or the window ended before"});
  EXPECT_DOUBLE_EQ(result.margin, 0.002);
}

TEST_F(Windows, EndEventuallyToo) {
  const auto judge = windowed(Eventually{condition("ego.speed > 5"), std::nullopt}, between(1, 3));
  run(*judge, {9, 0, 0, 0, 9});
  const auto result = expect(*judge, until(5 * ms, 5), Result::failed, {"not in 0.003 s"});
  EXPECT_EQ(result.covered_ticks, 3U);
  const auto in_time = windowed(Eventually{condition("ego.speed > 5"), std::nullopt}, between(1, 3));
  run(*in_time, {0, 0, 9, 0});
  EXPECT_DOUBLE_EQ(expect(*in_time, until(5 * ms, 5), Result::held).margin, 0.001);
}

TEST_F(Windows, SkippedTicksAreDue) {
  const auto judge = windowed(Never{condition("ego.speed > 5")}, between(2, 9));
  for (const std::int64_t tick : {0, 1, 2, 3, 9})
    set_speed(*judge, 0, tick * ms);
  expect(*judge, until(10 * ms, 10), Result::not_checked, {"evaluated on 3 of 8 ticks"});
}

TEST_F(Windows, AreJudgedWithoutAllocation) {
  const auto judge = windowed(Never{condition("ego.speed > 50")}, between(2, 40));
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int tick = 0; tick < 60; ++tick)
    set_speed(*judge, tick, tick * ms);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::expectations
