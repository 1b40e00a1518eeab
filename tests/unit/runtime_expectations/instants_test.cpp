// Expectations of test tables: values at instants.

#include "runtime/expectations/instants.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

class AtInstants : public Expectations {
 protected:
  static config::InstantCheck at(std::int64_t time_ms, std::uint32_t line, const std::string& value,
                                 const std::string& tolerance = "") {
    config::Diagnostics diagnostics;
    const config::Place place{"t.csv", line, 9};
    config::InstantCheck check{.time_ns = time_ms * ms,
                               .value = *config::Expression::parse(config::Word{value, place}, diagnostics)};
    if (!tolerance.empty())
      check.tolerance = config::Expression::parse(config::Word{tolerance, place}, diagnostics);
    return check;
  }
  /// Judged on all ticks up to the end.
  std::unique_ptr<Judge> judged(std::vector<config::InstantCheck> checks, double coverage = 1.0) {
    return judge_of_expectation({.name = "t: ego.speed",
                                 .place = {},
                                 .coverage = coverage,
                                 .claim = claim_of(Instants{{"ego.speed", {}}, std::move(checks)})});
  }
};

TEST_F(AtInstants, JudgesNoOtherTick) {
  const auto judge = judged({at(10, 2, "5", "0.5"), at(20, 3, "36 km/h", "1.8 km/h")});
  for (int tick = 0; tick < 40; ++tick)
    set_speed(*judge, tick == 10 ? 5.1 : tick == 20 ? 9.6 : 99.0, tick * ms);
  const auto result = expect(*judge, until(40 * ms, 40), Result::held);
  EXPECT_EQ(result.detail,
            "ego.speed at 2 instants: 9.6 m/s in line 3 at 0.020 s, expected 10 m/s within 0.5 m/s");
  EXPECT_NEAR(result.margin, 0.1, 1e-12);
  EXPECT_EQ(result.margin_unit, "m/s");
  EXPECT_EQ(result.worst_ns, 20 * ms);
  EXPECT_EQ(result.evaluated_ticks, 2U);
  EXPECT_EQ(result.covered_ticks, 2U);
}

TEST_F(AtInstants, FailsWhereTheErrorIsAboveTheTolerance) {
  const auto judge = judged({at(0, 2, "1", "0"), at(5, 3, "2", "0.5"), at(6, 4, "2", "0.5")});
  for (int tick = 0; tick < 10; ++tick)
    set_speed(*judge, tick == 0 ? 1.0 : tick == 5 ? 2.75 : 4.0, tick * ms);
  const auto result = expect(*judge, until(10 * ms, 10), Result::failed);
  EXPECT_EQ(
      result.detail,
      "ego.speed was wrong at 2 of 3 instants: 4 m/s in line 4 at 0.006 s, expected 2 m/s within 0.5 m/s");
  EXPECT_EQ(result.first_failure_ns, 5 * ms);
  EXPECT_EQ(result.margin, -1.5);
  EXPECT_EQ(result.worst_ns, 6 * ms);
}

TEST_F(AtInstants, AreNotCheckedWhereTheSignalIsUnknownOrTheTickSkipped) {
  const auto unknown = judged({at(1, 2, "1", "1"), at(3, 3, "1", "1")});
  for (int tick = 0; tick < 5; ++tick)
    set_speed(*unknown, tick == 3 ? std::nan("") : 1.0, tick * ms);
  expect(*unknown, until(5 * ms, 5), Result::not_checked, {"evaluated on 1 of 2 ticks (50 %)"});
  const auto skipped = judged({at(1, 2, "1", "1"), at(3, 3, "9", "1"), at(4, 4, "1", "1")});
  for (const int tick : {0, 1, 2, 4})
    set_speed(*skipped, 1.0, tick * ms);
  expect(*skipped, until(5 * ms, 5), Result::not_checked, {"evaluated on 2 of 3 ticks"});
  const auto ended = judged({at(1, 2, "1", "1")});
  set_speed(*ended, 1.0, 0);
  const auto result = expect(*ended, until(1 * ms, 5), Result::not_checked, {"none of 1 ticks"});
  EXPECT_TRUE(std::isnan(result.margin));
}

TEST_F(AtInstants, IsJudgedWithoutAllocation) {
  std::vector<config::InstantCheck> checks;
  for (int i = 0; i < 50; ++i)
    checks.push_back(at(2 * i, 2, "1", "1"));
  const auto judge = judged(std::move(checks));
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int tick = 0; tick < 100; ++tick)
    set_speed(*judge, 1.0, tick * ms);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  expect(*judge, until(100 * ms, 100), Result::held);
}

TEST_F(AtInstants, HaveMistakesAtTheirPlaces) {
  const signals::SignalId gear = table_.add({.name = "bus.Gear",
                                             .unit = "",
                                             .writer = "bus",
                                             .named_values = {{"Park", 3.0}, {"off", std::nan("")}}});
  const auto mistakes_of = [&](const std::string& signal, const config::InstantCheck& check) {
    config::Diagnostics diagnostics;
    check_claim(Instants{{signal, {"t.csv", 1, 1}}, {check}},
                {.known = signals::KnownSignals(table_), .period_ns = ms, .diagnostics = diagnostics});
    return diagnostics.to_text();
  };
  EXPECT_EQ(mistakes_of("bus.Gear", at(0, 2, "Park")), "");
  EXPECT_EQ(mistakes_of("ego.speed", at(0, 2, "1 km/h", "0")), "");
  EXPECT_EQ(mistakes_of("ego.sped", at(0, 2, "1", "0")),
            "t.csv:1:1: there is no signal 'ego.sped'; did you mean 'ego.speed'?\n");
  EXPECT_EQ(mistakes_of("ego.speed", at(0, 2, "1")),
            "t.csv:2:9: an expectation needs its tolerance, unless it is a value name\n");
  EXPECT_EQ(mistakes_of("ego.speed", at(0, 2, "1", "-1")), "t.csv:2:9: 'tolerance': '-1' is below 0\n");
  EXPECT_EQ(mistakes_of("ego.speed", at(0, 2, "1", "1 s")),
            "t.csv:2:9: 'tolerance' is in m/s; this is in s\n");
  EXPECT_EQ(mistakes_of("ego.speed", at(0, 2, "1 s", "1")),
            "t.csv:2:9: 'expectation' is in m/s; this is in s\n");
  EXPECT_EQ(mistakes_of("ego.speed", at(0, 2, "ego.speed", "1")),
            "t.csv:2:9: 'ego.speed' is neither a number nor a signal, and 'ego.speed' has no value names\n");
  EXPECT_EQ(
      mistakes_of("bus.Gear", at(0, 2, "Prak")),
      "t.csv:2:9: 'Prak' is neither a number nor a signal, and 'bus.Gear' has no value of that name; did "
      "you mean 'Park'? Known here: Park, off\n");
  EXPECT_EQ(mistakes_of("bus.Gear", at(0, 2, "off")),
            "t.csv:2:9: 'bus.Gear' has several values with the name 'off'; use the number\n");
  const auto judge = judge_of_expectation(
      {.name = "g", .place = {}, .claim = claim_of(Instants{{"bus.Gear", {}}, {at(0, 2, "Park")}})});
  table_.write(gear, 3.0, 0);
  judge->check(table_, {.time_ns = 0});
  EXPECT_EQ(expect(*judge, until(ms), Result::held).margin, 0.0);
}

}  // namespace
}  // namespace hil::expectations
