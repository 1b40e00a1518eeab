// Margins of conditions and of the kinds of expectation.

#include "runtime/expectations/margin.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

class Margins : public Expectations {
 protected:
  const signals::SignalId car_ = table_.add({.name = "car.speed", .unit = "km/h", .writer = "car"});
  const signals::SignalId oil_ = table_.add({.name = "oil", .unit = "degC", .writer = "car"});

  double margin_of(const std::string& text) {
    ConditionMargin margin(condition(text), table_, {.period_ns = ms, .seed = 7});
    unit_ = margin.unit();
    return margin.at(table_, {.time_ns = 0});
  }
  std::string unit_;
};

TEST_F(Margins, OfAComparisonIsTheDistanceOfItsSides) {
  table_.write(speed_, 10.0, 0);
  EXPECT_EQ(margin_of("ego.speed < 12"), 2.0);
  EXPECT_EQ(unit_, "m/s");
  EXPECT_EQ(margin_of("ego.speed <= 12 m/s"), 2.0);
  EXPECT_EQ(margin_of("ego.speed > 12"), -2.0);
  EXPECT_EQ(margin_of("12 >= ego.speed"), 2.0);
}

TEST_F(Margins, AreInTheUnitOfTheSignals) {
  table_.write(speed_, 10.0, 0);
  table_.write(car_, 90.0, 0);
  EXPECT_DOUBLE_EQ(margin_of("car.speed < 100"), 10.0);
  EXPECT_EQ(unit_, "km/h");
  EXPECT_DOUBLE_EQ(margin_of("ego.speed < car.speed"), 15.0);
  EXPECT_EQ(unit_, "m/s");
  table_.write(oil_, 90.0, 0);
  EXPECT_NEAR(margin_of("oil < 80"), -10.0, 1e-9);
  EXPECT_EQ(unit_, "K");
  EXPECT_NEAR(margin_of("oil < 80 degC"), -10.0, 1e-9);
  EXPECT_NEAR(margin_of("oil < 80 degC + 5 degC"), -5.0, 1e-9);
  EXPECT_NEAR(margin_of("oil - 70 degC < 23 degC"), 3.0, 1e-9) << "a difference beside a difference";
  EXPECT_EQ(unit_, "K");
  EXPECT_NEAR(margin_of("not (abs(oil - 95 degC) > 9 degF)"), 0.0, 1e-9);
}

TEST_F(Margins, OfAndOrNotAreTheLeastTheGreatestTheOpposite) {
  table_.write(speed_, 10.0, 0);
  EXPECT_EQ(margin_of("ego.speed > 4 and ego.speed < 12"), 2.0);
  EXPECT_EQ(margin_of("ego.speed < 4 or ego.speed > 9"), 1.0);
  EXPECT_EQ(margin_of("not (ego.speed < 4 or ego.speed > 9)"), -1.0);
}

TEST_F(Margins, ExistOnlyForComparisonsOfOneKind) {
  table_.write(speed_, 10.0, 0);
  table_.write(oil_, 90.0, 0);
  for (const char* text :
       {"ego.speed == 10", "ego.speed != 3", "known(ego.speed)", "ego.speed > 4 and bus.Header.Counter == 0",
        "ego.speed > 4 and oil > 80 degC", "bus.Header.Counter"})
    EXPECT_TRUE(std::isnan(margin_of(text))) << text;
}

TEST_F(Margins, AreNotKnownWithAnUnknownSignal) {
  table_.write(speed_, not_known, 0);
  EXPECT_TRUE(std::isnan(margin_of("ego.speed > 4")));
}

TEST_F(Margins, HaveTheRandomNumbersOfTheirCondition) {
  table_.write(speed_, 1.0, 0);
  const auto judge = this->judge(Always{condition("ego.speed + noise(1 m/s) > 0")});
  for (int tick = 0; tick < 1000; ++tick)
    judge->check(table_, {.time_ns = tick * ms});
  const auto result = expect(*judge, until(1000 * ms, 1000), Result::failed);
  EXPECT_LT(result.margin, 0.0);
  const auto held = this->judge(Always{condition("ego.speed + noise(1 m/s) > -100")});
  for (int tick = 0; tick < 1000; ++tick)
    held->check(table_, {.time_ns = tick * ms});
  EXPECT_DOUBLE_EQ(expect(*held, until(1000 * ms, 1000), Result::held).margin, result.margin + 100.0);
}

TEST_F(Margins, OfNeverAndAlwaysAreTheLeastOfAllTicks) {
  const auto never = judge(Never{condition("ego.speed > 14")});
  const auto always = judge(Always{condition("ego.speed > 2")});
  for (const auto& [tick, speed] : {std::pair{0, 10.0}, {1, 13.0}, {2, 2.5}, {3, 12.0}}) {
    set_speed(*never, speed, tick * ms);
    set_speed(*always, speed, tick * ms);
  }
  auto result = never->result(until(4 * ms, 4));
  EXPECT_EQ(result.margin, 1.0);
  EXPECT_EQ(result.margin_unit, "m/s");
  EXPECT_EQ(result.worst_ns, ms);
  result = always->result(until(4 * ms, 4));
  EXPECT_EQ(result.margin, 0.5);
  EXPECT_EQ(result.worst_ns, 2 * ms);
  set_speed(*never, 20.0, 4 * ms);
  set_speed(*never, 18.0, 5 * ms);
  result = expect(*never, until(6 * ms, 6), Result::failed);
  EXPECT_EQ(result.margin, -6.0);
  EXPECT_EQ(result.worst_ns, 4 * ms);
}

TEST_F(Margins, OfNeverIsNoNegativeZero) {
  const auto never = judge(Never{condition("ego.speed > 0")});
  set_speed(*never, 0.0, 0);
  const auto result = expect(*never, until(ms, 1), Result::held);
  EXPECT_EQ(result.margin, 0.0);
  EXPECT_FALSE(std::signbit(result.margin));
}

TEST_F(Margins, OfAFailureThatIsNotKnownIsNotKnown) {
  const auto always = judge(Always{condition("ego.speed > 2 and bus.Header.Counter > 0")});
  table_.write(request_, not_known, 0);
  set_speed(*always, 1.0, 0);  // false and unknown is false
  const auto result = expect(*always, until(ms, 1), Result::failed);
  EXPECT_TRUE(std::isnan(result.margin));
  EXPECT_EQ(result.worst_ns, 0);
}

TEST_F(Margins, OfTimesAreInSeconds) {
  const auto in_time = judge(Eventually{condition("ego.speed == 0"), 5 * ms});
  set_speed(*in_time, 0.0, 2 * ms);
  auto result = in_time->result(until(9 * ms));
  EXPECT_DOUBLE_EQ(result.margin, 0.003);
  EXPECT_EQ(result.margin_unit, "s");
  const auto late = judge(Eventually{condition("ego.speed == 0"), 5 * ms});
  set_speed(*late, 5.0, 0);
  set_speed(*late, 0.0, 7 * ms);
  EXPECT_DOUBLE_EQ(late->result(until(9 * ms)).margin, -0.002);
  const auto answered = responses(50 * ms);
  request(*answered, 1, 10 * ms);
  reply(*answered, 1, 42 * ms);
  result = answered->result(until(1'000 * ms));
  EXPECT_DOUBLE_EQ(result.margin, 0.018);
  EXPECT_EQ(result.worst_ns, 10 * ms);
  request(*answered, 2, 100 * ms);
  result = expect(*answered, until(1'000 * ms), Result::failed);
  EXPECT_TRUE(std::isnan(result.margin)) << "there is no reply";
  EXPECT_EQ(result.worst_ns, 150 * ms);
}

TEST_F(Margins, OfACountAreTheDistanceToTheNearerLimit) {
  const auto count = judge(Count{condition("ego.speed > 5"), 1, 4});
  for (int tick = 0; tick < 6; ++tick)
    set_speed(*count, tick % 2 == 0 ? 9 : 0, tick * ms);
  EXPECT_EQ(expect(*count, until(6 * ms, 6), Result::held).margin, 1.0) << "3 of 1 to 4";
  for (int tick = 6; tick < 12; ++tick)
    set_speed(*count, tick % 2 == 0 ? 9 : 0, tick * ms);
  EXPECT_EQ(expect(*count, until(12 * ms, 12), Result::failed).margin, -2.0);
}

}  // namespace
}  // namespace hil::expectations
