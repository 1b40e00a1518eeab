// Figures of a signal and their limits.

#include "runtime/expectations/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

class Figures : public Expectations {
 protected:
  static Limits limits(const char* min, const char* max) {
    Limits made;
    if (min != nullptr) made.min = condition(min);
    if (max != nullptr) made.max = condition(max);
    return made;
  }
  static Statistics figure(Statistics::Figure figure, const char* min, const char* max) {
    Statistics claim{.signal = {"ego.speed", {}}, .limits = {}, .overshoot = {}, .settling = {}};
    claim.limits[figure] = limits(min, max);
    return claim;
  }
  static Statistics step(const char* from) {
    Statistics claim{.signal = {"ego.speed", {}}, .limits = {}, .overshoot = {}, .settling = {}};
    StepResponse response{condition("5 m/s"), std::nullopt};
    if (from != nullptr) response.from = condition(from);
    claim.overshoot = {response, 0.1};
    claim.settling = {response, 0.02, 6 * ms};
    return claim;
  }
  void run(Judge& judge, std::initializer_list<double> speeds) {
    ticks_ = 0;
    for (const double speed : speeds)
      set_speed(judge, speed, static_cast<std::int64_t>(ticks_++) * ms);
  }
  report::Expectation result_of(const Judge& judge, Result expected) {
    return expect(judge, until(static_cast<std::int64_t>(ticks_) * ms, ticks_), expected);
  }
  std::uint64_t ticks_ = 0;
};

TEST_F(Figures, AreThoseOfTheValues) {
  const auto judge = this->judge(figure(Statistics::mean, "4 m/s", "6 m/s"));
  run(*judge, {2, 4, 4, 4, 5, 5, 7, 9});
  const auto result = result_of(*judge, Result::held);
  EXPECT_EQ(result.detail,
            "statistics of ego.speed: mean 5 m/s, rms 5.385 m/s, standard deviation 2 m/s, smallest 2 m/s, "
            "largest 9 m/s");
  EXPECT_DOUBLE_EQ(result.margin, 1.0);
  EXPECT_EQ(result.margin_unit, "m/s");
}

TEST_F(Figures, HaveLimitsOfEachKind) {
  const std::tuple<Statistics::Figure, const char*, double, std::int64_t> cases[] = {
      {Statistics::mean, "18 km/h", 0.0, -1},
      {Statistics::mean, "4.5 m/s", -0.5, -1},
      {Statistics::rms, "5 m/s", 5.0 - std::sqrt(29.0), -1},
      {Statistics::standard_deviation, "1.5 m/s", -0.5, -1},
      {Statistics::smallest, "1 m/s", -1.0, 0},
      {Statistics::largest, "8 m/s", -1.0, 7}};
  for (const auto& [which, max, margin, worst_ms] : cases) {
    const auto judge = this->judge(figure(which, nullptr, max));
    run(*judge, {2, 4, 4, 4, 5, 5, 7, 9});
    const auto result = result_of(*judge, margin < 0.0 ? Result::failed : Result::held);
    EXPECT_NEAR(result.margin, margin, 1e-12) << key_of(which);
    if (worst_ms >= 0) {
      EXPECT_EQ(result.worst_ns, worst_ms * ms) << key_of(which);
    }
  }
  const auto least = this->judge(figure(Statistics::smallest, "3 m/s", nullptr));
  run(*least, {5, 2, 4});
  const auto result = result_of(*least, Result::failed);
  EXPECT_EQ(result.first_failure_ns, ms);
  EXPECT_DOUBLE_EQ(result.margin, -1.0);
}

TEST_F(Figures, StayExactFarFromZero) {
  const auto judge = this->judge(figure(Statistics::standard_deviation, "0.99 m/s", "1.01 m/s"));
  for (int tick = 0; tick < 100'000; ++tick)
    set_speed(*judge, 1e9 + (tick % 2 == 0 ? 1.0 : -1.0), tick * ms);
  const auto result = expect(*judge, until(100'000 * ms, 100'000), Result::held);
  EXPECT_NEAR(result.margin, 0.01, 1e-6);
}

TEST_F(Figures, OfAStepAreOvershootAndSettlingTime) {
  const auto judge = this->judge(step("0 m/s"));
  run(*judge, {0, 2, 4, 5.4, 5.2, 4.95, 5.01, 5});  // 8 % over, within 0.1 m/s from 5 ms on
  const auto result = result_of(*judge, Result::held);
  EXPECT_NE(result.detail.find("overshoot 8 %, settling time 5 ms"), std::string::npos) << result.detail;
  EXPECT_NEAR(result.margin, 0.001, 1e-12) << "of the settling time: 1 ms of 6 ms; 2 % of 10 % is more";
  EXPECT_EQ(result.margin_unit, "s");
  EXPECT_EQ(result.worst_ns, 4 * ms);
  const auto over = this->judge(step("0 m/s"));
  run(*over, {0, 2, 4, 5.6, 5, 5});
  const auto failed = result_of(*over, Result::failed);
  EXPECT_NEAR(failed.margin, -2.0, 1e-9);
  EXPECT_EQ(failed.margin_unit, "%");
  EXPECT_EQ(failed.first_failure_ns, 3 * ms);
}

TEST_F(Figures, OfAStepDownAndFromTheFirstValue) {
  const auto judge = this->judge(step(nullptr));
  run(*judge, {10, 8, 5, 4.8, 5, 5});  // 4 % of the step of 5 m/s
  EXPECT_NE(result_of(*judge, Result::held).detail.find("overshoot 4 %, settling time 4 ms"),
            std::string::npos);
  const auto none = this->judge(step(nullptr));
  run(*none, {5, 5, 5});
  EXPECT_NE(result_of(*none, Result::not_checked).detail.find("so there is no step"), std::string::npos);
}

TEST_F(Figures, OfASignalThatMadeNoStepAreNotChecked) {
  for (const std::initializer_list<double> speeds :
       {std::initializer_list<double>{5, 5, 5, 5}, {4.95, 5.05, 5, 5}, {3, 4, 5, 5}, {5, 4, 1.01, 5}})
    for (const bool is_overshoot : {true, false}) {
      Statistics claim = step("0 m/s");
      if (is_overshoot) claim.settling.reset();
      if (!is_overshoot) claim.overshoot.reset();
      const auto judge = this->judge(claim);
      run(*judge, speeds);
      EXPECT_NE(
          result_of(*judge, Result::not_checked)
              .detail.find("was never within 10 % of the step of its begin at 0 m/s, so it made no step"),
          std::string::npos);
    }
  // The step comes after the begin: a signal that leaves the final value has not made it.
  Statistics claim = step("0 m/s");
  claim.settling.reset();
  const auto away = this->judge(claim);
  run(*away, {5, 5, 0, 0});
  EXPECT_NE(result_of(*away, Result::not_checked).detail.find("did not reach 90 % of the step"),
            std::string::npos);
  const auto late = this->judge(step("0 m/s"));
  run(*late, {5, 5, 0.4, 5, 5});
  result_of(*late, Result::held);
}

/// Frames of a tick, and the tick.
TEST_F(Figures, OfFramesAreExtremesAndSteps) {
  const auto frames = [&](Judge& judge, double flash) {
    for (int tick = 0; tick < 10; ++tick) {
      table_.write(speed_, tick == 5 ? flash : tick == 0 ? 0.0 : 5.0, tick * ms);
      judge.check(table_, {.time_ns = tick * ms, .is_tick = false});
      set_speed(judge, tick == 0 ? 0.0 : 5.0, tick * ms);
    }
    ticks_ = 10;
  };
  const auto largest = this->judge(figure(Statistics::largest, nullptr, "6 m/s"));
  frames(*largest, 99.0);
  EXPECT_EQ(result_of(*largest, Result::failed).first_failure_ns, 5 * ms);
  const auto smallest = this->judge(figure(Statistics::smallest, "-1 m/s", nullptr));
  frames(*smallest, -99.0);
  result_of(*smallest, Result::failed);
  const auto over = this->judge(step("0 m/s"));
  frames(*over, 99.0);
  result_of(*over, Result::failed);
  const auto mean = this->judge(figure(Statistics::mean, "4.49 m/s", "4.51 m/s"));
  frames(*mean, 99.0);
  EXPECT_EQ(result_of(*mean, Result::held).evaluated_ticks, 10U) << "the mean is that of the ticks";
  Statistics settling = step("0 m/s");
  settling.overshoot.reset();
  settling.settling->at_most_ns = 4 * ms;
  const auto settled = this->judge(settling);
  frames(*settled, 5.0);
  result_of(*settled, Result::held);
  const auto disturbed = this->judge(settling);
  frames(*disturbed, 4.0);
  result_of(*disturbed, Result::failed);
}

TEST_F(Figures, ThatDoNotSettleFail) {
  const auto judge = this->judge(step("0 m/s"));
  run(*judge, {0, 5, 4});
  const auto result = result_of(*judge, Result::failed);
  EXPECT_NE(result.detail.find("not settled at the end"), std::string::npos) << result.detail;
  EXPECT_TRUE(std::isnan(result.margin)) << "how late it would be is not known";
  EXPECT_EQ(result.first_failure_ns, 2 * ms);
  run(*judge, {0, 5, 4, 4, 4, 4, 4, 4, 4, 4});
  EXPECT_NEAR(result_of(*judge, Result::failed).margin, -0.004, 1e-12) << "10 ms and more, of at most 6 ms";
}

TEST_F(Figures, OfAnUnknownSignalAreNotChecked) {
  const auto judge = this->judge(figure(Statistics::mean, "4 m/s", "6 m/s"));
  run(*judge, {std::nan(""), std::nan("")});
  EXPECT_TRUE(std::isnan(result_of(*judge, Result::not_checked).margin));
  const auto partly = this->judge(figure(Statistics::mean, "4 m/s", "6 m/s"));
  run(*partly, {std::nan(""), 5});
  EXPECT_NE(result_of(*partly, Result::not_checked).detail.find("evaluated on 1 of 2 ticks"),
            std::string::npos);
}

TEST_F(Figures, AreJudgedWithoutAllocation) {
  const auto judge = this->judge(step("0 m/s"));
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int tick = 0; tick < 60; ++tick)
    set_speed(*judge, tick, tick * ms);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::expectations
