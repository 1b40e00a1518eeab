// The functions of expressions, step by step. A step is 0.1 s.

#include "runtime/expression/function.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <utility>

#include "compiled.hpp"
#include "tests/paths.h"
#include "tests/support/allocation_guard.hpp"

namespace hil::expression {
namespace {

using test::compile;
using test::unknown;
using test::value_of;

/// The results of an expression of `a` for its values in successive steps.
std::vector<double> steps(const std::string& written, const std::vector<double>& a,
                          const std::string& unit = "") {
  auto program = compile(written, {.unit = unit});
  std::vector<double> values = test::Names().values(), results;
  for (std::size_t i = 0; i < a.size(); ++i) {
    values[0] = a[i];
    results.push_back(program->evaluate(values, 0.1 * static_cast<double>(i)));
    EXPECT_TRUE(!program->has_state() || std::isnan(results.back()) ||
                program->evaluate_between_steps(values, 0.0) == results.back())
        << "between steps the result stays";
  }
  return results;
}

void expect_near(const std::vector<double>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (std::isnan(expected[i]))
      EXPECT_TRUE(std::isnan(found[i])) << "step " << i << ": " << found[i];
    else
      EXPECT_NEAR(found[i], expected[i], 1e-12) << "step " << i;
  }
}

TEST(Functions, WithoutAState) {
  EXPECT_EQ(value_of("abs(-3) + min(4, 2, 3) + max(1, 5)"), 10.0);
  EXPECT_EQ(value_of("clamp(9, 1, 4) + clamp(-9, 1, 4) + clamp(2, 1, 4)"), 7.0);
  EXPECT_NEAR(value_of("exp(ln(5)) + log10(1000)"), 8.0, 1e-12);
  EXPECT_NEAR(value_of("sin(90 deg) + cos(0) + tan(45 deg)"), 3.0, 1e-12);
  EXPECT_NEAR(value_of("asin(1) + acos(1) + atan(0)", "deg"), 90.0, 1e-12);
  EXPECT_NEAR(value_of("atan2(x, x)", "deg"), 45.0, 1e-12);
  EXPECT_EQ(value_of("hypot(x, 4 m)", "m"), 5.0);
  EXPECT_EQ(value_of("sign(-x) + sign(x) + sign(0)"), 0.0);
  EXPECT_EQ(value_of("floor(-1.5) + ceil(1.2) + round(2.5)"), 3.0);
  EXPECT_EQ(value_of("mod(-1, 4) + mod(7 m, 4 m) / 1 m"), 6.0);
}

TEST(Functions, OfTheStepBefore) {
  expect_near(steps("previous(a)", {1, 2, 5}), {1, 1, 2});
  expect_near(steps("previous(a, 7)", {1, 2, 5}), {7, 1, 2});
  expect_near(steps("delay(a, 0.2 s)", {1, 2, 3, 4}), {1, 1, 1, 2});
  expect_near(steps("delay(a, 200 ms, -1)", {1, 2, 3, 4}), {-1, -1, 1, 2});
  expect_near(steps("delay(a, 0 s)", {1, 2}), {1, 2});
  expect_near(steps("derivative(a)", {1, 2, 5}, "1/s"), {0, 10, 30});
  expect_near(steps("integral(a)", {1, 2, 5, 0}, "s"), {0, 0.1, 0.3, 0.8});
  expect_near(steps("integral(a, a > 4)", {1, 2, 5, 0}, "s"), {0, 0.1, 0, 0.5});
}

TEST(Functions, ThatFollow) {
  const double share = 1.0 - std::exp(-0.1 / 0.5);
  expect_near(steps("lag(a, dt, 0)", {1, 1, 1}), {0, share, share + share * (1.0 - share)});
  expect_near(steps("lag(a, dt)", {4, 4}), {4, 4});
  expect_near(steps("rate_limit(a, 20 / 1 s)", {0, 5, 5, 5, 0}), {0, 2, 4, 5, 3});
  expect_near(steps("rate_limit(a, 20 / 1 s, 100 / 1 s)", {0, 5, 0}), {0, 2, 0});
  expect_near(steps("hold(a, a > 3)", {1, 5, 2, 4, 0}), {1, 5, 5, 4, 4});
}

TEST(Functions, OfConditions) {
  expect_near(steps("hysteresis(a, 1, 3)", {2, 3, 2, 1, 2}), {0, 1, 1, 0, 0});
  expect_near(steps("rise(a > 1)", {2, 0, 2, 2, 0}), {1, 0, 1, 0, 0});
  expect_near(steps("fall(a > 1)", {0, 2, 0, 0, 2}), {0, 0, 1, 0, 0});
  expect_near(steps("changed(a)", {2, 2, 3, 3}), {0, 0, 1, 0});
  expect_near(steps("count(a > 1)", {2, 0, 2, 0, 2}), {1, 1, 2, 2, 3});
  expect_near(steps("count(a > 1, a < 0)", {0, 2, -1, 2}), {0, 1, 0, 1});
  expect_near(steps("latch(a > 1, a < 0)", {0, 2, 0, -1, 0}), {0, 1, 1, 0, 0});
  expect_near(steps("duration(a > 1)", {2, 2, 2, 0, 2}, "s"), {0, 0.1, 0.2, 0, 0});
}

constexpr double u = unknown;

TEST(UnknownArguments, MemoryBeginsWithTheFirstKnownOne) {
  for (const std::string function : {"previous(a)",
                                     "previous(a, 7)",
                                     "delay(a, 0.2 s)",
                                     "delay(a, 0.2 s, 7)",
                                     "lag(a, dt)",
                                     "lag(a, dt, 7)",
                                     "rate_limit(a, 20 / 1 s)",
                                     "hysteresis(a, 1, 3)",
                                     "rise(a > 1)",
                                     "fall(a > 1)",
                                     "changed(a)",
                                     "count(a > 1)",
                                     "count(a > 1, false)",
                                     "latch(a > 1, false)",
                                     "latch(a > 1, true)",
                                     "hold(a, true)",
                                     "hold(a, false)",
                                     "duration(a > 1) / 1 s",
                                     "integral(a) / 1 s",
                                     "integral(a, true) / 1 s",
                                     "derivative(a) * 1 s",
                                     "pid(a, 2, 0, 0, -5, 5)",
                                     "uniform(a, a)",
                                     "noise(a)"}) {
    for (const double result : steps(function, {u, u, u}))
      EXPECT_TRUE(std::isnan(result)) << function << " of what was never known";
    const std::vector<double> late = steps(function, {u, u, 2, 0, 4, 4}),
                              at_once = steps(function, {2, 0, 4, 4});
    if (function.starts_with("uniform") || function.starts_with("noise")) continue;
    expect_near({late.begin() + 2, late.end()}, at_once);
  }
}

TEST(UnknownArguments, EndInUnknownResults) {
  expect_near(steps("previous(a)", {1, u, 3, 4}), {1, u, 1, 3});
  expect_near(steps("delay(a, 0.2 s)", {1, 2, u, 4, 5}), {1, 1, 1, 2, u});
  expect_near(steps("rate_limit(a, 20 / 1 s)", {0, u, u, 5}), {0, u, u, 2});
  expect_near(steps("hysteresis(a, 1, 3)", {4, u, 2, 0, u, 2}), {1, u, 1, 0, u, 0});
  expect_near(steps("hold(a, a < 5)", {1, 7, u, 7, 2}), {1, 1, u, 1, 2});
  expect_near(steps("duration(a > 1)", {2, 2, u, 2, 0, 2, 2}, "s"), {0, 0.1, u, u, 0, 0, 0.1});
  const double share = 1.0 - std::exp(-0.1 / 0.5);
  expect_near(steps("lag(a, dt, 0)", {1, 1, u, u, 1, 1}),
              {0, share, u, u, share + share * (1.0 - share), 1.0 - std::pow(1.0 - share, 3.0)});
  expect_near(steps("pid(a, 0, 10, 0, -5, 5)", {1, 1, u, u, 1}), {0, 1, u, u, 2});
}

TEST(UnknownArguments, DoNotBecomeTrueBetweenTwoTrues) {
  expect_near(steps("rise(a > 1)", {u, 2, u, 2, 0, u, 2}), {u, 1, u, 0, 0, u, 1});
  expect_near(steps("fall(a > 1)", {u, 0, u, 0, 2, u, 0}), {u, 0, u, 0, 0, u, 1});
  expect_near(steps("changed(a)", {u, 2, u, 2, u, 3}), {u, 0, u, 0, u, 1});
}

TEST(UnknownArguments, MakeADurationALowerBound) {
  const std::vector<double> values{2, 2, u, 2, 2, 2, u, 2, 2, 0, 2, 2};
  const std::string duration = "duration(a > 1)";
  expect_near(steps(duration + " > 150 ms", values), {0, 0, u, u, u, 1, u, u, u, 0, 0, 0});
  expect_near(steps(duration + " <= 150 ms", values), {1, 1, u, u, u, 0, u, u, u, 1, 1, 1});
  expect_near(steps(duration + " >= 100 ms", values), {0, 1, u, u, 1, 1, u, u, 1, 0, 0, 1});
  expect_near(steps(duration, values, "s"), {0, 0.1, u, u, u, u, u, u, u, 0, 0, 0.1});
  // Before the first known condition nothing is known, as of a count.
  expect_near(steps(duration, {u, u, 2, 2}, "s"), {u, u, 0, 0.1});
  // A gap between two steps that are false hides no time that is still counted.
  expect_near(steps(duration, {0, u, 0, 2, 2}, "s"), {0, u, 0, 0, 0.1});
}

/// What is known of a duration is true however the unknown steps were.
TEST(UnknownArguments, KnownDurationsAreThoseOfEveryPossiblePast) {
  std::mt19937 random(20);
  int decided_after_gap = 0;
  for (int variant = 0; variant < 3000; ++variant) {
    std::vector<double> values(14);
    std::vector<std::size_t> gaps;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto draw = random() % 10;
      values[i] = draw < 6 ? 2.0 : draw < 8 || i == 0 || gaps.size() == 4 ? 0.0 : u;
      if (std::isnan(values[i])) gaps.push_back(i);
    }
    const std::string limit = std::to_string(50 + 100 * (random() % 4)) + " ms";
    const std::string written = "duration(a > 1)" + std::string(random() % 2 == 0 ? " > " : " <= ") + limit;
    const std::vector<double> found = steps(written, values);
    for (unsigned past = 0; past < 1U << gaps.size(); ++past) {
      std::vector<double> possible = values;
      for (std::size_t k = 0; k < gaps.size(); ++k)
        possible[gaps[k]] = (past >> k & 1U) != 0 ? 2.0 : 0.0;
      const std::vector<double> expected = steps(written, possible);
      for (std::size_t i = 0; i < found.size(); ++i) {
        if (std::isnan(found[i])) continue;
        ASSERT_EQ(found[i], expected[i]) << written << " in step " << i << " of variant " << variant;
        if (!gaps.empty() && i > gaps.front() && values[i] != 0.0) ++decided_after_gap;
      }
    }
  }
  EXPECT_GT(decided_after_gap, 1000);
}

TEST(UnknownArguments, MakeACountALowerBound) {
  const std::vector<double> values{2, 0, 2, u, 2, 0, 2, -1, 2};
  // Two were seen before the gap, one after it, then a reset makes the count exact.
  const std::string count = "count(a > 1, time > 0.65 s and time < 0.75 s)";
  expect_near(steps(count, values), {1, 1, 2, u, u, u, u, 0, 1});
  expect_near(steps(count + " > 2", values), {0, 0, 0, u, u, u, 1, 0, 0});
  expect_near(steps("2 < " + count, values), {0, 0, 0, u, u, u, 1, 0, 0});
  expect_near(steps(count + " >= 2", values), {0, 0, 1, u, 1, 1, 1, 0, 0});
  expect_near(steps(count + " <= 2", values), {1, 1, 1, u, u, u, 0, 1, 1});
  expect_near(steps("2 > " + count, values), {1, 1, 0, u, 0, 0, 0, 1, 1});
  expect_near(steps(count + " == 2", values), {0, 0, 1, u, u, u, 0, 0, 0});
  expect_near(steps(count + " == 5", values), {0, 0, 0, u, u, u, u, 0, 0});
  expect_near(steps(count + " != 2", values), {1, 1, 0, u, u, u, 1, 1, 1});
  expect_near(steps(count + " + 1 > 3", values), {0, 0, 0, u, u, u, 1, 0, 0});
  expect_near(steps("3 - " + count + " > 2", values), {0, 0, 0, u, u, u, u, 1, 0});
  expect_near(steps(count + " > " + count, values), {0, 0, 0, u, u, u, u, 0, 0});
  expect_near(steps("not " + count, values), {0, 0, 0, u, 0, 0, 0, 1, 0});
  expect_near(steps("if a > 1 then " + count + " > 1 else false", values), {0, 0, 1, u, 1, 0, 1, 0, 0});
  EXPECT_EQ(compile(count, {.truth = true})->evaluate(test::Names().values(), 0.0), 0.0);
}

TEST(UnknownArguments, UnknownResetMakesTheResultUnknown) {
  // b is 2, so `lost` alone is unknown; a selects the reset.
  const std::string reset = "(if a == 7 then lost == 1 else a < 0)";
  const std::vector<double> values{2, 0, 7, 2, -1, 2};
  expect_near(steps("count(a > 1, " + reset + ")", values), {1, 1, u, u, 0, 1});
  expect_near(steps("count(a > 1, " + reset + ") > 0", values), {1, 1, u, u, 0, 1});
  expect_near(steps("integral(a, " + reset + ")", values, "s"), {0, 0.2, u, u, 0, -0.1});
  expect_near(steps("latch(a == 2, " + reset + ")", values), {1, 1, u, 1, 0, 1});
}

TEST(UnknownArguments, EndALatchAndAnIntegralUntilTheirReset) {
  expect_near(steps("latch(a > 1, a < 0)", {0, u, 0, 0, -1, 0}), {0, u, u, u, 0, 0});
  expect_near(steps("latch(a > 1, a < 0)", {0, u, 2, 0}), {0, u, 1, 1});  // it is true, whatever was before
  expect_near(steps("integral(a, a < 0)", {1, u, 2, -1, 3, 0}, "s"), {0, u, u, 0, -0.1, 0.2});
  expect_near(steps("integral(a)", {1, u, 2, 2}, "s"), {0, u, u, u});
}

/// The results for values at run times in steps of 0.1 s.
std::vector<double> steps_at(const std::string& written, const std::vector<std::pair<double, double>>& a,
                             const std::string& unit = "") {
  auto program = compile(written, {.unit = unit});
  std::vector<double> values = test::Names().values(), results;
  for (const auto& [number, value] : a) {
    values[0] = value;
    results.push_back(program->evaluate(values, 0.1 * number));
  }
  return results;
}

TEST(SkippedSteps, FunctionsUseTheLastValueForSkippedSteps) {
  for (const std::string function :
       {"previous(a)", "delay(a, 0.3 s)", "delay(a, 0.3 s, 7)", "delay(a, 0.1 s)", "lag(a, dt)",
        "lag(a, dt, 7)", "rate_limit(a, 20 / 1 s)", "rate_limit(a, 20 / 1 s, 3 / 1 s)", "hysteresis(a, 1, 3)",
        "count(a > 1)", "latch(a > 3, a < 2)", "hold(a, a > 3)", "duration(a > 1) / 1 s", "integral(a) / 1 s",
        "integral(a, a > 6) / 1 s", "pid(a, 1, 4, 0, -50, 50)"}) {
    const std::vector<double> values{1, 4, 4, 4, 9, 0, 0, 3, 2};
    const std::vector<double> all = steps(function, values);
    const std::vector<double> some = steps_at(function, {{0, 1}, {1, 4}, {4, 9}, {5, 0}, {7, 3}, {8, 2}});
    SCOPED_TRACE(function);
    expect_near(some, {all[0], all[1], all[4], all[5], all[7], all[8]});
  }
  // More steps than the delay has.
  expect_near(steps_at("delay(a, 0.2 s)", {{0, 1}, {1, 2}, {90, 3}, {91, 4}, {92, 5}}), {1, 1, 2, 2, 3});
}

/// A value of `a` that was written at a run time, and is read in a step.
struct Written {
  double step = 0.0, value = 0.0, at_s = 0.0;
};
std::vector<double> judged(const std::string& written, const std::vector<Written>& a,
                           const std::string& unit = "") {
  auto program = compile(written, {.unit = unit});
  std::vector<double> values = test::Names().values(), results;
  std::vector<WriteTimes> times(values.size());
  for (const Written& one : a) {
    values[0] = one.value;
    times[0] = {.newest_s = one.at_s, .oldest_s = one.at_s};
    results.push_back(program->evaluate(values, EvaluationTime{.time_s = 0.1 * one.step, .written = times}));
  }
  return results;
}

TEST(Derivative, GoesFromOneWrittenValueToTheNext) {
  const std::vector<Written> slow{{0, 1, 0.0}, {1, 1, 0.0}, {2, 1, 0.0}, {3, 4, 0.3},
                                  {4, 4, 0.3}, {5, 4, 0.3}, {6, 10, 0.6}};
  expect_near(judged("derivative(a)", slow, "1/s"), {u, u, u, 10, 10, 10, 20});
  expect_near(judged("derivative(2 * a + b)", slow, "1/s"), {u, u, u, 20, 20, 20, 40});
  expect_near(judged("derivative(derivative(a))", slow, "1/s2"), {u, u, u, u, u, u, 10 / 0.3});
  expect_near(judged("pid(a, 0, 0, 1, -50, 50)", slow), {u, u, u, 10, 10, 10, 20});
  // The same value again is a value.
  expect_near(judged("derivative(a)", {{0, 1, 0.0}, {1, 2, 0.1}, {2, 2, 0.2}}, "1/s"), {u, 10, 0});
  // Stamps of frames between the steps, and a gap.
  expect_near(judged("derivative(a)", {{0, 1, -0.05}, {1, 2, 0.05}, {2, u, 0.05}, {9, 11, 0.85}}, "1/s"),
              {u, 10, u, 9 / 0.8});
  // Time itself is written in each step.
  expect_near(judged("derivative(time)", slow), {u, 1, 1, 1, 1, 1, 1});
}

/// Signals that rise by 1 and by 3 per second, written at two rates, read in steps of 0.1 s.
TEST(Derivative, OfSignalsOfTwoRatesStepsWhereAllAreWritten) {
  std::mt19937 random(3);
  for (int variant = 0; variant < 400; ++variant) {
    double fast_s = 0.1, slow_s = 0.2 + 0.1 * static_cast<double>(random() % 12);
    if (variant % 3 == 1)
      fast_s = 0.1 + 0.01 * static_cast<double>(random() % 30), slow_s = 2.03 * fast_s + 0.07;
    const bool a_is_fast = variant % 2 == 0, is_multiple = variant % 3 != 1;
    const double of_a_s = a_is_fast ? fast_s : slow_s, of_b_s = a_is_fast ? slow_s : fast_s;
    auto program = compile("derivative(a + 3 * b)", {.unit = "1/s"});
    auto chosen = compile("derivative(if time < 3 s then a else b)", {.unit = "1/s"});
    std::vector<double> values = test::Names().values();
    std::vector<WriteTimes> times(values.size());
    int known = 0;
    for (int step = 0; step < 400; ++step) {
      const double now_s = 0.1 * step;
      const auto write = [&](std::size_t index, double period_s) {
        const double at_s = period_s * std::floor(now_s / period_s + 1e-9);
        values[index] = at_s;
        times[index] = {.newest_s = at_s, .oldest_s = at_s};
      };
      write(0, of_a_s);
      write(1, of_b_s);
      const EvaluationTime at{.time_s = now_s, .written = times};
      const double slope = program->evaluate(values, at);
      const double choice = chosen->evaluate(values, at);
      if (is_multiple && now_s > 4.0 + 2 * slow_s) {
        EXPECT_NEAR(choice, 1.0, 1e-6);
      }
      if (std::isnan(slope)) continue;
      ++known;
      // The faster one is up to one of its periods old, and the slower one up to one step.
      const double of_fast = a_is_fast ? 1.0 : 3.0, of_slow = 4.0 - of_fast;
      const double error = (of_fast * fast_s + of_slow * 0.1) / (slow_s - 0.1);
      ASSERT_NEAR(slope, 4.0, is_multiple ? 1e-6 : error + 1e-9) << fast_s << " and " << slow_s;
    }
    EXPECT_GT(known, 300);
  }
}

TEST(Derivative, IsUnknownUntilAllSignalsAreWrittenAnew) {
  auto program = compile("derivative(a + b)", {.unit = "1/s"});
  std::vector<double> values = test::Names().values();
  std::vector<WriteTimes> times(values.size());
  times[1] = {.newest_s = 0.0, .oldest_s = 0.0};
  for (int step = 0; step < 10; ++step) {
    values[0] = step;
    times[0] = {.newest_s = 0.1 * step, .oldest_s = 0.1 * step};
    EXPECT_TRUE(std::isnan(program->evaluate(values, {.time_s = 0.1 * step, .written = times})));
  }
  // A value that was computed from signals of several ages counts as its oldest one.
  auto of_variable = compile("derivative(a)", {.unit = "1/s"});
  std::vector<double> results;
  for (int step = 0; step < 9; ++step) {
    const double oldest_s = 0.4 * std::floor(step / 4.0);
    values[0] = 0.1 * step + oldest_s;
    times[0] = {.newest_s = 0.1 * step, .oldest_s = oldest_s};
    results.push_back(of_variable->evaluate(values, {.time_s = 0.1 * step, .written = times}));
  }
  expect_near(results, {u, u, u, u, 2, 2, 2, 2, 2});
}

TEST(Frames, BetweenStepsAdvanceMemoryButNoNoise) {
  auto count = compile("count(a > 1)", {});
  auto noise = compile("noise(2)", {});
  auto delay = compile("delay(a, 0.1 s)", {});
  std::vector<double> values = test::Names().values();
  const auto step = [&](Program& program, double time_s, double value, bool is_tick) {
    values[0] = value;
    return program.evaluate(values, EvaluationTime{.time_s = time_s, .is_tick = is_tick});
  };
  EXPECT_EQ(step(*count, 0.0, 0, true), 0.0);
  EXPECT_EQ(step(*count, 0.03, 2, false), 1.0);
  EXPECT_EQ(step(*count, 0.06, 0, false), 1.0);
  EXPECT_EQ(step(*count, 0.1, 2, true), 2.0);
  const double first = step(*noise, 0.0, 0, true);
  EXPECT_EQ(step(*noise, 0.03, 0, false), first);
  EXPECT_NE(step(*noise, 0.1, 0, true), first);
  EXPECT_EQ(step(*delay, 0.0, 1, true), 1.0);
  EXPECT_EQ(step(*delay, 0.04, 5, false), 1.0);
  EXPECT_EQ(step(*delay, 0.1, 2, true), 1.0);
  EXPECT_EQ(step(*delay, 0.2, 3, true), 2.0) << "the tick's value counts, not that of a frame before it";
}

TEST(Functions, RefuseConstantArgumentsOutOfRange) {
  for (const auto& [written, problem] : std::vector<std::pair<std::string, std::string>>{
           {"lag(a, -1 ms)", "'lag': its time constant is below 0"},
           {"uniform(5, -5)", "'uniform': its low is above its high"},
           {"noise(-1)", "'noise': its deviation is below 0"},
           {"clamp(a, 3, 2)", "'clamp': its low is above its high"},
           {"hysteresis(a, 3, 2)", "'hysteresis': its low is above its high"},
           {"pid(a, 1, 1, 1, 5, -5)", "'pid': its low is above its high"},
           {"clamp(kmh, 40, 10 m/s)", "'clamp': its low is above its high"},
           {"sqrt(-1)", "'sqrt' has no value for these arguments"},
           {"ln(0)", "'ln' has no value for these arguments"},
           {"asin(2)", "'asin' has no value for these arguments"},
           {"mod(5, 0)", "'mod' has no value for these arguments"}}) {
    std::string mistakes;
    EXPECT_FALSE(compile(written, {.unit = std::nullopt}, &mistakes)) << written;
    EXPECT_NE(mistakes.find(problem), std::string::npos) << written << ": " << mistakes;
  }
  for (const char* written : {"lag(a, 0 ms)", "uniform(5, 5)", "noise(0)", "clamp(a, 2, 2)", "clamp(a, b, 2)",
                              "clamp(kmh, 30, 10 m/s)", "sqrt(a - 5)", "mod(5, a)"})
    EXPECT_TRUE(compile(written, {.unit = std::nullopt})) << written;
}

TEST(Programs, ValueInAllStepsIsKnownOnlyIfNoInputDecides) {
  const std::vector<double> nothing(test::Names().all.size(), unknown);
  const auto result = [&](const std::string& written) {
    return compile(written, {.truth = true})->value_in_all_steps(nothing);
  };
  EXPECT_EQ(result("a > 3 and 2 < 1"), 0.0);
  EXPECT_EQ(result("a > 3 or 1 == 1"), 1.0);
  EXPECT_EQ(result("not (a > 3 and false)"), 1.0);
  for (const char* written :
       {"a > 3", "a == a", "known(a)", "known(a) or known(b)", "time > 5 s", "noise(1) > 2",
        "count(true) > 2", "duration(true) > 5 s", "a * 0 > 1", "previous(3) > 2", "latch(false, true)"})
    EXPECT_TRUE(std::isnan(result(written))) << written;
  std::vector<double> with_b = nothing;
  with_b[1] = 0.0;
  EXPECT_EQ(compile("b == 0 or a > 3", {.truth = true})->value_in_all_steps(with_b), 1.0);
  auto program = compile("count(a > 0)", {});
  EXPECT_EQ(program->evaluate(test::Names().values(), 0.0), 1.0);
  program->value_in_all_steps(nothing);
  EXPECT_EQ(program->evaluate(test::Names().values(), 0.1), 1.0) << "its memory does not advance";
}

TEST(Functions, PidControls) {
  expect_near(steps("pid(a, 2, 0, 0, -5, 5)", {1, -1, 9}), {2, -2, 5});
  expect_near(steps("pid(a, 0, 10, 0, -5, 5)", {1, 1, 1}), {0, 1, 2});
  expect_near(steps("pid(a, 0, 0, 1, -50, 50)", {1, 2, 4}), {0, 10, 20});
  // Its integral grows no further at a limit, so it leaves the limit with the sign of the error.
  std::vector<double> error(20, 1.0);
  error.insert(error.end(), {-1.0, -1.0, -1.0});
  const std::vector<double> output = steps("pid(a, 0, 10, 0, -5, 5)", error);
  EXPECT_EQ(output[19], 5.0);
  EXPECT_LT(output.back(), 4.0);
  EXPECT_EQ(value_of("pid(x, 2 N/m, 0 N/m/s, 0 N s/m, 0 N, 100 N)", "N"), 6.0);
}

TEST(Functions, NoiseIsThatOfTheSeed) {
  const std::vector<double> zeros(20'000, 0.0);
  const std::vector<double> normal = steps("noise(2)", zeros);
  EXPECT_EQ(normal, steps("noise(2)", zeros));
  double sum = 0.0, squares = 0.0;
  for (const double value : normal) {
    sum += value;
    squares += value * value;
  }
  EXPECT_NEAR(sum / 20'000, 0.0, 0.06);
  EXPECT_NEAR(std::sqrt(squares / 20'000), 2.0, 0.05);
  const std::vector<double> uniform = steps("uniform(3, 5)", zeros);
  EXPECT_NEAR(*std::ranges::min_element(uniform), 3.0, 1e-3);
  EXPECT_NEAR(*std::ranges::max_element(uniform), 5.0, 1e-3);
  const auto two = steps("noise(1) - noise(1)", zeros);
  EXPECT_GT(std::ranges::count_if(two, [](double value) { return value != 0.0; }), 19'000)
      << "each call has values of its own";
}

TEST(Functions, EvaluationDoesNotAllocate) {
  auto program = compile(
      "lag(x, dt) + delay(x, 2 s) * noise(1) + max(x, 1 m, 2 m) + (if rise(a > 1) or state == red then x "
      "else 4)",
      {.unit = "mm"});
  const std::vector<double> values = test::Names().values();
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int i = 0; i < 100; ++i)
    program->evaluate(values, 0.1 * i);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

TEST(Functions, ResetBeginsAnew) {
  auto program = compile("count(a > 0) + previous(a, 7)", {});
  std::vector<double> values = test::Names().values();
  const double first = program->evaluate(values, 0.0);
  values[0] = -1.0;
  program->evaluate(values, 0.0);
  values[0] = 1.0;
  EXPECT_NE(program->evaluate(values, 0.0), first);
  program->reset();
  EXPECT_EQ(program->evaluate(values, 0.0), first);
}

TEST(Functions, AreDescribedInTheGuide) {
  std::ifstream file(HIL_SOURCE_DIR "/docs/guide/expressions.md");
  const std::string guide(std::istreambuf_iterator<char>(file), {});
  for (const Function& function : functions()) {
    const std::string row = "| `" + std::string(function.name) + "(" + std::string(function.arguments) +
                            ")` | " + std::string(function.about) + " |\n";
    EXPECT_NE(guide.find(row), std::string::npos) << row;
    EXPECT_EQ(std::ranges::count(functions(), function.name, &Function::name), 1) << function.name;
  }
}

}  // namespace
}  // namespace hil::expression
