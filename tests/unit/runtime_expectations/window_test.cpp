// Windows: the ticks on which an expectation is judged.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

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
  const auto result =
      expect(*reaction, until(8 * ms, 8), Result::not_checked,
             {"1 of 1 reaction in time", "1 not judged, since the run or the window ended before",
              "evaluated on 3 of 5 ticks"});
  EXPECT_EQ(result.evaluated_ticks, 3U);
  ASSERT_EQ(result.not_evaluated.size(), 1U);
  EXPECT_EQ(result.not_evaluated[0].begin_ns, 5 * ms);
  EXPECT_EQ(result.not_evaluated[0].end_ns, 6 * ms);
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

/// Ticks of which nobody knows whether they are in the window.
class WindowGaps : public Windows {
 protected:
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  const signals::SignalId opens_ = table_.add({.name = "bus.Mode.Opens", .unit = "", .writer = "bus"});
  const signals::SignalId closes_ = table_.add({.name = "bus.Mode.Closes", .unit = "", .writer = "bus"});
  struct Step {
    double opens = 0.0, closes = 0.0, speed = 0.0;
  };

  static config::WindowSection between_conditions(bool has_after = true) {
    config::WindowSection window{
        .place = {}, .from_ns = {}, .to_ns = {}, .after = {}, .until = condition("bus.Mode.Closes == 1")};
    if (has_after) window.after = condition("bus.Mode.Opens == 1");
    return window;
  }
  template <class Data>
  std::unique_ptr<Judge> judge_in(Data claim, const config::WindowSection& window, double coverage = 0.95) {
    config::Expectation expectation{
        .name = "claim", .place = {}, .window = window, .claim = claim_of(std::move(claim))};
    expectation.coverage = coverage;
    return judge_of_expectation(expectation);
  }
  void instant(Judge& judge, const Step& step, std::int64_t time_ns, bool is_tick = true) {
    table_.write(opens_, step.opens, time_ns);
    table_.write(closes_, step.closes, time_ns);
    table_.write(speed_, step.speed, time_ns);
    judge.check(table_, {.time_ns = time_ns, .is_tick = is_tick});
  }
  void ticks(Judge& judge, const Step& step, std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t time = from_ms; time < to_ms; ++time)
      instant(judge, step, time * ms);
  }
};

TEST_F(WindowGaps, TrueConditionThereIsNotEvaluated) {
  const auto never = judge_in(Never{condition("ego.speed > 5")}, between_conditions(false));
  ticks(*never, {.speed = 1}, 0, 900);
  ticks(*never, {.closes = unknown, .speed = 9}, 900, 901);
  ticks(*never, {.closes = unknown, .speed = 1}, 901, 1000);
  const auto result =
      expect(*never, until(1000 * ms, 1000), Result::not_checked,
             {"it was unknown whether 0.900 s is in its window, and the result depends on it"});
  EXPECT_EQ(result.evaluated_ticks, 999U);
  ASSERT_EQ(result.not_evaluated.size(), 1U);
  EXPECT_EQ(result.not_evaluated[0].signals, std::vector<std::string>{"bus.Mode.Closes"});
}

TEST_F(WindowGaps, FailureInsideStays) {
  const auto never = judge_in(Never{condition("ego.speed > 5")}, between_conditions());
  ticks(*never, {}, 0, 10);
  ticks(*never, {.opens = 1, .speed = 9}, 10, 11);
  ticks(*never, {.closes = unknown, .speed = 9}, 11, 100);
  EXPECT_EQ(expect(*never, until(100 * ms, 100), Result::failed).first_failure_ns, 10 * ms);
}

TEST_F(WindowGaps, WhatNeverCameDecidesNothingThatItCanNotChange) {
  const auto never = judge_in(Never{condition("ego.speed > 5")}, between_conditions(false));
  ticks(*never, {.closes = unknown, .speed = 1}, 0, 1000);
  expect(*never, until(1000 * ms, 1000), Result::held);
  const auto eventually =
      judge_in(Eventually{condition("ego.speed > 5"), std::nullopt}, between_conditions(false));
  ticks(*eventually, {.closes = unknown, .speed = 1}, 0, 990);
  ticks(*eventually, {.closes = unknown, .speed = 9}, 990, 1000);
  expect(*eventually, until(1000 * ms, 1000), Result::not_checked,
         {"bus.Mode.Closes was never known, on 10 ticks that it decides"});
}

TEST_F(WindowGaps, BeforeTheFirstValueOfAfterTicksAreDue) {
  for (const auto& [late_ms, expected] : {std::pair{20, Result::held}, {60, Result::not_checked}}) {
    const auto always = judge_in(Always{condition("ego.speed > 5")}, between_conditions());
    ticks(*always, {.opens = unknown, .speed = 1}, 0, late_ms);
    ticks(*always, {.speed = 1}, late_ms, 100);
    ticks(*always, {.opens = 1, .speed = 9}, 100, 1000);
    const auto result = expect(*always, until(1000 * ms, 1000), expected);
    EXPECT_EQ(result.evaluated_ticks, 900U);
    EXPECT_EQ(result.covered_ticks, 900U + static_cast<unsigned>(late_ms));
  }
  const auto gap = judge_in(Always{condition("ego.speed > 5")}, between_conditions());
  ticks(*gap, {.speed = 1}, 0, 10);
  ticks(*gap, {.opens = unknown, .speed = 1}, 10, 11);
  ticks(*gap, {.speed = 1}, 11, 100);
  ticks(*gap, {.opens = 1, .speed = 9}, 100, 1000);
  expect(*gap, until(1000 * ms, 1000), Result::not_checked, {"whether 0.010 s is in its window"});
}

TEST_F(WindowGaps, FrameThereIsNotEvaluatedEither) {
  const auto never = judge_in(Never{condition("ego.speed > 5")}, between_conditions(false));
  ticks(*never, {}, 0, 10);
  instant(*never, {.closes = unknown, .speed = 9}, 10 * ms, false);
  ticks(*never, {.closes = unknown}, 10, 12);
  ticks(*never, {}, 12, 1000);
  expect(*never, until(1000 * ms, 1000), Result::not_checked, {"whether 0.010 s is in its window"});
}

TEST_F(WindowGaps, CountsOrdersAndReactionsAreNotJudgedInThem) {
  const std::vector<std::pair<const char*, std::unique_ptr<Judge>>> judges = [&] {
    std::vector<std::pair<const char*, std::unique_ptr<Judge>>> all;
    all.emplace_back("count", judge_in(Count{condition("ego.speed > 5"), 0, 0}, between_conditions(false)));
    all.emplace_back("order", judge_in(Order{{condition("ego.speed > 5"), condition("ego.speed > 6")}},
                                       between_conditions(false)));
    all.emplace_back("reaction",
                     judge_in(Reaction{condition("ego.speed > 5"), condition("ego.speed > 50"), 20 * ms},
                              between_conditions(false)));
    return all;
  }();
  for (const auto& [kind, judge] : judges) {
    ticks(*judge, {}, 0, 10);
    ticks(*judge, {.closes = unknown, .speed = 9}, 10, 11);
    ticks(*judge, {}, 11, 1000);
    const auto result = judge->result(until(1000 * ms, 1000));
    EXPECT_EQ(result.result, Result::not_checked) << kind << ": " << result.detail;
  }
}

/// A verdict is the one of every choice of the ticks that may be in the window.
TEST_F(WindowGaps, VerdictsHoldForEveryPossibleWindow) {
  std::mt19937 random(7);
  const auto claim_holds = [](int kind, const std::vector<double>& all, const std::vector<bool>& inside) {
    int count = 0;
    bool any_fast = false, any_slow = false;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!inside[i]) continue;
      (all[i] > 5 ? any_fast : any_slow) = true;
      if (all[i] > 5 && (i == 0 || all[i - 1] <= 5)) ++count;
    }
    return kind == 0 ? !any_fast : kind == 1 ? !any_slow : kind == 2 ? any_fast : count >= 1 && count <= 2;
  };
  std::array<int, 3> verdicts{};
  for (int variant = 0; variant < 8000; ++variant) {
    const int kind = variant % 4;
    const auto window = between_conditions();
    const Count counts{condition("ego.speed > 5"), 1, 2};
    const auto judge = kind == 0   ? judge_in(Never{condition("ego.speed > 5")}, window, 0.0)
                       : kind == 1 ? judge_in(Always{condition("ego.speed > 5")}, window, 0.0)
                       : kind == 2 ? judge_in(Eventually{condition("ego.speed > 5"), {}}, window, 0.0)
                                   : judge_in(counts, window, 0.0);
    constexpr std::size_t length = 16;
    std::vector<double> speeds(length);
    std::vector<bool> inside(length);
    std::vector<std::size_t> doubtful;
    enum class State : std::uint8_t { before, open, closed } state = State::before;
    const bool is_mostly_fast = random() % 2 == 0;
    for (std::size_t i = 0; i < length; ++i) {
      const auto draw = [&]() -> double {
        const auto value = random() % 12;
        return value == 0 ? 1.0 : value < 3 && i > 0 && doubtful.size() < 5 ? unknown : 0.0;
      };
      const Step step{draw(), draw(), (random() % 6 == 0) != is_mostly_fast ? 9.0 : 1.0};
      speeds[i] = step.speed;
      const bool was_open = state == State::open;
      if (state == State::before && std::isnan(step.opens)) doubtful.push_back(i);
      if (state == State::before && step.opens == 1.0) state = State::open;
      if (was_open && step.closes == 1.0) state = State::closed;
      if (was_open && std::isnan(step.closes))
        doubtful.push_back(i);
      else
        inside[i] = state == State::open;
      instant(*judge, step, static_cast<std::int64_t>(i) * ms);
    }
    const auto result = judge->result(until(length * ms, length));
    ++verdicts[static_cast<std::size_t>(result.result)];
    if (result.result == Result::not_checked) continue;
    for (unsigned choice = 0; choice < 1U << doubtful.size(); ++choice) {
      for (std::size_t k = 0; k < doubtful.size(); ++k)
        inside[doubtful[k]] = (choice >> k & 1U) != 0;
      ASSERT_EQ(claim_holds(kind, speeds, inside), result.result == Result::held)
          << "kind " << kind << ", variant " << variant << ": " << result.detail;
    }
  }
  for (const int count : verdicts)
    EXPECT_GT(count, 400);
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
