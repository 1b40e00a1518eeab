// Mistakes of expectations in a scenario, all reported at once with their places.

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::expectations {
namespace {

const std::string scenario = R"(scenario: tank
base_rate: 1 kHz
duration: 10 s
tasks:
  - module: tank
    type: block
    rate: 1 kHz
    parameters: {states: {level: {initial: 1 m, derivative: 0 m/s}}}
can:
  - {bus: car, device: virtual, database: test.dbc, rate: 100 Hz, receive: [{message: Status, timeout: 1 s}]}
expectations:
)";
const std::string database = R"(VERSION ""
BU_: HIL ECU
BO_ 768 Status: 8 ECU
 SG_ Mode : 0|4@1+ (1,0) [0|0] "" HIL
)";

class ExpectationMistakes : public run::test::WiringFixture {
 protected:
  ExpectationMistakes() {
    folder_.write("test.dbc", database);
    folder_.write("good.csv", "time,level\n0,1\n5,2\n");
    folder_.write("two.csv", "time,level,flow\n0,1,2\n5,2,3\n");
    folder_.write("gap.csv", "time,level\n0,1\n1,\n2,2\n");
    folder_.write("falling.csv", "time,level\n0,1\n2,1\n1,2\n");
    folder_.write("late.csv", "time,level\n10,1\n20,2\n");
  }
  /// Whether each entry has the one mistake with the words beside it, all reported at once.
  void expect_mistakes(const std::vector<std::pair<std::string, std::string>>& entries) {
    std::string text = scenario;
    for (std::size_t i = 0; i < entries.size(); ++i)
      text += "  - {name: e" + std::to_string(i) + ", " + entries[i].first + "}\n";
    EXPECT_FALSE(wired(text));
    for (const auto& [entry, words] : entries) {
      int found = 0;
      for (const config::Mistake& mistake : diagnostics_.mistakes())
        found += mistake.message.find(words) != std::string::npos ? 1 : 0;
      EXPECT_EQ(found, 1) << entry << "\nwants: " << words << "\n" << diagnostics_.to_text();
    }
    EXPECT_EQ(diagnostics_.count(), entries.size()) << diagnostics_.to_text();
    for (const config::Mistake& mistake : diagnostics_.mistakes())
      EXPECT_GT(mistake.place.line, 0U) << mistake.message;
  }
};

TEST_F(ExpectationMistakes, OfWhatCanNotFailOrCanNotHold) {
  expect_mistakes({
      {"never: tank.level > 5 m and 2 < 1", "the condition is always false, whatever its signals are"},
      {"always: tank.level > 5 m or true", "the condition is always true, whatever its signals are"},
      {"never: tank.level == tank.level", "both operands of '==' are the same"},
      {"always: can.car.Status.Mode + 1 >= can.car.Status.Mode + 1", "both operands of '>=' are the same"},
      {"never: tank.level > 2 m, after: tank.level < tank.level", "both operands of '<' are the same"},
  });
}

TEST_F(ExpectationMistakes, OfConditionsWithOneResultInAllKinds) {
  for (const char* entry :
       {"eventually: not (false and tank.level > 5 m)", "count: {of: tank.level > 1 m and 0 == 1, max: 3}",
        "order: [tank.level > 1 m, tank.level > 1 m or 2 > 1]", "never: 1 > 2 and known(can.car.Status.Mode)",
        "reaction: {when: tank.level > 1 m or 2 > 1, then: tank.level > 2 m, within: 1 s}",
        "always: tank.level > 1 m, until: tank.level > 3 m and false"})
    expect_mistakes({{entry, "whatever its signals are"}});
}

/// Conditions with one result by their form, inside of others that leave it what it is.
TEST_F(ExpectationMistakes, OfConditionsWithOneResultByTheirForm) {
  const std::string x = "tank.level", c = "can.car.Status.Mode > 3";
  const std::vector<std::string> constant{x + " - " + x + " < 1 m",
                                          "min(" + x + ", " + x + ") >= max(" + x + ", " + x + ", " + x + ")",
                                          x + " / " + x + " == 1",
                                          "not (" + c + ") or " + c,
                                          c + " and can.car.Status.Mode <= 3",
                                          "3 < can.car.Status.Mode or 3 >= can.car.Status.Mode",
                                          "if " + c + " then true else true",
                                          "(if " + c + " then 2 m else 2 m) > 1 m",
                                          "if true then 1 > 2 else " + c,
                                          "latch(" + c + ", true)",
                                          "latch(" + c + ", " + x + " <= " + "max(" + x + ", " + x + "))",
                                          "count(" + c + ", true) == 0",
                                          "count(false) == 0",
                                          "count(" + c + " and not " + c + ") > 0",
                                          "duration(false) > 1 s",
                                          "rise(true)",
                                          "changed(3 m)",
                                          "hold(3 m, " + c + ") == 3 m",
                                          "previous(3 m) == 3 m",
                                          "lag(3 m, 2 s) > 2 m",
                                          "delay(2 * 3 m, 100 ms) < 7 m",
                                          "clamp(" + x + ", 3 m, 3 m) == 3 m",
                                          "known(3 m)",
                                          "integral(" + x + ", true) > 1 m s",
                                          x + " + 0 - " + x + " * 1 > 0 m",
                                          "--" + x + " - " + x + " > 1 m",
                                          "not not (true or " + c + ")",
                                          "previous(" + x + ") - previous(" + x + ") == 0 m"};
  constexpr std::uint64_t seed = 74'080;
  std::mt19937_64 random(seed);
  const std::vector<std::string> wholes{"%", "not (%)", "(%) or (%)", "(%) and (%)",
                                        "if (%) then true else false"};
  for (const std::string& condition : constant) {
    std::string whole = wholes[random() % wholes.size()];
    for (std::size_t at; (at = whole.find('%')) != std::string::npos;)
      whole.replace(at, 1, condition);
    const bool has_signal = whole.find('.') != std::string::npos;
    if (!has_signal) whole += " or known(" + x + ") and not known(" + x + ")";
    const std::string text = scenario + "  - {name: e, never: \"" + whole + "\"}\n";
    EXPECT_FALSE(wired(text)) << whole << ", seed " << seed;
    for (const config::Mistake& mistake : diagnostics_.mistakes())
      EXPECT_NE(mistake.message.find("says nothing about the run"), std::string::npos) << mistake.message;
  }
  for (const std::string& condition :
       {x + " - previous(" + x + ") < 1 m", "uniform(0, 1) - uniform(0, 1) > " + x + " / 1 m",
        "noise(1 m) == noise(1 m) + " + x, "min(" + x + ", 2 m) < 1 m", "latch(" + c + ", " + c + ")",
        "count(" + c + ", " + x + " > 1 m) > 2", "hold(3 m + " + x + ", " + c + ") > 4 m",
        c + " or can.car.Status.Mode <= 2", "if " + c + " then true else false", "previous(3 m, 2 m) < " + x,
        "hold(" + x + ", true) > 1 m", "latch(true, " + c + ")", x + " * 0 > -1 m",
        "known(" + x + ") or " + c, "duration(" + c + ") > 1 s",
        "rate_limit(" + x + ", 1 m/s, 0 m/s) > 1 m"}) {
    EXPECT_TRUE(wired(scenario + "  - {name: e, never: \"" + condition + "\"}\n")) << condition << "\n"
                                                                                   << diagnostics_.to_text();
    EXPECT_EQ(diagnostics_.warnings().size(), 0U) << condition << "\n" << diagnostics_.to_text();
  }
}

TEST_F(ExpectationMistakes, OfEqualConditionsOfOneExpectation) {
  expect_mistakes({
      {"reaction: {when: tank.level > 1 m, then: 1 m < tank.level, within: 1 s}", "each reaction is in time"},
      {"order: [tank.level > 1 m, tank.level > 2 m, not (tank.level <= 2 m)]", "they have no order"},
  });
  for (const auto& [entry, words] :
       {std::pair{"never: 0 / 0 > tank.level / 1 m", "this constant has no value"},
        {"always: tank.level < 1 m / 0", "this constant has no value"},
        {"never: \"rate_limit(tank.level, -1 m/s) > 5 m\"", "its rate is not above 0"},
        {"never: \"rate_limit(tank.level, 0 m/s) > 5 m\"", "its rate is not above 0"},
        {"never: \"rate_limit(tank.level, 1 m/s, -1 m/s) > 5 m\"", "its falling rate is below 0"}})
    expect_mistakes({{entry, words}});
  EXPECT_TRUE(
      wired(scenario +
            "  - {name: stays, reaction: {when: tank.level > 1 m, then: tank.level > 1 m, within: 1 s, "
            "for_at_least: "
            "2 s}}\n  - {name: again, order: [tank.level > 1 m, tank.level > 2 m, tank.level > 1 m]}\n"))
      << diagnostics_.to_text();
}

TEST_F(ExpectationMistakes, WarnOfVariablesThatMakeOperandsEqualOrArgumentsWrong) {
  const std::string variables =
      "variables: {limit: tank.level, further: limit, half: tank.level / 2, negative: -1 m, wrong: -1 m/s, "
      "before: "
      "-1 s, five: 5 m}\n";
  for (const auto& [claim, words] :
       {std::pair{"always: tank.level <= limit", "always true with the variables"},
        {"never: further - tank.level > 1 m", "always false with the variables"},
        {"never: \"max(limit, further) > tank.level\"", "always false with the variables"},
        {"reaction: {when: tank.level > 1 m, then: further > 1 m, within: 1 s}", "each reaction is in time"},
        {"order: [tank.level > 1 m, limit > 1 m]", "they have no order"},
        {"never: \"rate_limit(tank.level, wrong) > 5 m\"", "its rate is not above 0, with the variables"},
        {"never: \"lag(tank.level, before) > 5 m\"", "its time constant is below 0, with the variables"},
        {"never: \"uniform(five, negative) > tank.level\"", "its low is above its high, with the variables"},
        {"never: \"hysteresis(tank.level, five, negative)\"",
         "its low is above its high, with the variables"},
        {"never: \"clamp(tank.level, five, negative) > 7 m\"",
         "its low is above its high, with the variables"},
        {"always: tank.level <= half", ""},
        {"never: \"clamp(tank.level, negative, five) > 6 m\"", ""}}) {
    EXPECT_TRUE(wired(scenario + "  - {name: e, " + claim + "}\n" + variables)) << claim << "\n"
                                                                                << diagnostics_.to_text();
    std::string warnings;
    for (const config::Mistake& warning : diagnostics_.warnings())
      warnings += warning.message + "\n";
    EXPECT_NE(warnings.find(words), std::string::npos) << claim << "\n" << warnings;
    EXPECT_EQ(warnings.empty(), std::string(words).empty()) << claim << "\n" << warnings;
  }
}

TEST_F(ExpectationMistakes, OfConditionsOfTheTimeAloneNameWindows) {
  for (const char* entry : {"never: tank.level > 9 m, after: time > 1 s",
                            "reaction: {when: time > 1 s, then: tank.level > 1 m, within: 1 s}"})
    expect_mistakes({{entry, "'between', 'by'"}});
}

TEST_F(ExpectationMistakes, OfTimesThatNothingCanBeLateFor) {
  expect_mistakes({
      {"reaction: {when: tank.level > 1 m, then: tank.level > 2 m, within: 10 s}",
       "'within': 10 s is as long as the run, which takes 10 s, so nothing could be late"},
      {"response: {request: can.car.Status.Mode, reply: can.car.Status.Other, within: 12 s}",
       "'within': 12 s is as long as the run"},
      {"reaction: {when: tank.level > 1 m, then: tank.level > 2 m, within: 2 s}, between: [3 s, 5 s]",
       "'within': 2 s is as long as the window, which takes 2 s"},
      {"never: tank.level > 5 m, between: [9 s, 11 s]",
       "'between': 11 s is after the end of the run, which takes 10 s"},
  });
}

TEST_F(ExpectationMistakes, OfTimesOfFunctionsAsLongAsTheRun) {
  expect_mistakes({
      {"never: duration(tank.level > 5 m) > 10 s",
       "'duration' is compared with 10 s, which is as long as the run of 10 s or longer"},
      {"always: 2 * 1 h >= duration(tank.level > 5 m)", "'duration' is compared with 7200 s"},
      {"eventually: tank.level > 2 m or duration(tank.level > 5 m) >= 11 s - 500 ms",
       "'duration' is compared with 10500 ms"},
      {"count: {of: duration(tank.level > 5 m) == 12 s, max: 3}", "'duration' is compared with 12 s"},
      {"never: tank.level > 5 m, after: duration(tank.level > 5 m) > 13", "'duration' is compared with 13 s"},
      {"never: 'delay(tank.level, 14 s) > 5 m'", "'delay' has a value of before 14 s"},
      {"never: 'abs(delay(tank.level, 10 s, 0 m)) > 5 m'", "'delay' has a value of before 10 s"},
  });
  for (const char* entry :
       {"never: duration(tank.level > 5 m) > 9999 ms", "never: duration(tank.level > 5 m) < 9 s",
        "never: 'delay(tank.level, 9999 ms) > 5 m'", "never: tank.level > 50 m and time < 20 s",
        "never: duration(tank.level > 5 m) * 3 > 20 s"}) {
    diagnostics_ = {};
    EXPECT_TRUE(wired(scenario + "  - {name: a, " + entry + "}\n")) << entry << diagnostics_.to_text();
  }
  diagnostics_ = {};
  EXPECT_TRUE(wired(scenario + "  - {name: a, never: duration(tank.level > 5 m) > limit}\n"
                               "  - {name: b, never: duration(tank.level > 5 m) > limit / 2}\n"
                               "variables: {limit: 12 s}\n"))
      << diagnostics_.to_text();
  ASSERT_EQ(diagnostics_.warnings().size(), 1U);
  EXPECT_NE(diagnostics_.warnings()[0].message.find("compared with 12 s"), std::string::npos);
  for (const auto& [variables, words] :
       {std::pair{"{d: other, other: duration(tank.level > 5 m)}", "'duration' is compared with 15 s"},
        {"{d: 'delay(tank.level, 10 s) / 1 m * 1 s'}", "'delay' has a value of before 10 s"},
        {"{d: 'if duration(tank.level > 5 m) > 11 s then 1 s else 2 s'}",
         "'duration' is compared with 11 s"}}) {
    diagnostics_ = {};
    EXPECT_FALSE(wired(scenario + "  - {name: a, never: d > 15 s}\nvariables: " + variables + "\n"));
    EXPECT_EQ(diagnostics_.count(), 1U) << diagnostics_.to_text();
    EXPECT_NE(diagnostics_.to_text().find(words), std::string::npos) << diagnostics_.to_text();
  }
}

TEST_F(ExpectationMistakes, AreWarningsWhereOnlyAVariableMakesThemSo) {
  EXPECT_TRUE(wired(scenario + "  - {name: off, always: installed == 0 or tank.level > 5 m}\n"
                               "  - {name: by others, never: low and tank.level > 5 m}\n"
                               "  - {name: on, always: installed == 1 or tank.level > 5 m}\n"
                               "  - {name: known, never: known(can.car.Status.Mode)}\n"
                               "variables: {installed: 0, low: installed > 2}\n"))
      << diagnostics_.to_text();
  std::string warnings;
  for (const config::Mistake& warning : diagnostics_.warnings())
    warnings += warning.message + "\n";
  EXPECT_NE(warnings.find("the condition is always true with the variables of the scenario"),
            std::string::npos)
      << warnings;
  EXPECT_NE(warnings.find("the condition is always false with the variables of the scenario"),
            std::string::npos)
      << warnings;
}

TEST_F(ExpectationMistakes, OfTheFileAreReportedAtOnce) {
  expect_mistakes({
      {"never: tank.level > 5 m, between: [3 s, 2 s]",
       "'between': 2 s is before the begin of the window, 3 s"},
      {"never: tank.level > 5 m, between: [10 s, 20 s]", "'between': 10 s is not before the end of the run"},
      {"never: tank.level > 5 m, between: [9999999 us, 10 s]",
       "'between': 9999.999 ms is after the last tick of the run, at "},
      {"count: {of: tank.level > 5 m, min: 0}",
       "'count' needs a 'min' of at least 1, a 'max', or both; without them every count holds"},
      {"eventually: tank.level > 5 m, between: [4 s, 8 s], by: 3 s",
       "'by': 3 s is before the begin of the window, 4 s"},
      {"never: tank.level > 5 m, after: tank.level >", "the expression ends"},
      {"cycle_time: {message: can.car.Status, period: 10 ms, tolerance: 12 ms}",
       "'tolerance': 12 ms is not less than the period, 10 ms"},
      {"tracks: {signal: tank.level, reference: gap.csv, tolerance: 1 m}", "an empty cell"},
      {"tracks: {signal: tank.level, reference: falling.csv, tolerance: 1 m}",
       "times have to be strictly increasing"},
      {"tracks: {signal: tank.level, reference: two.csv, tolerance: 1 m}", "'column' has to name one"},
      {"tracks: {signal: tank.level, reference: two.csv, column: levl, tolerance: 1 m}",
       "no column 'levl'; did you mean 'level'?"},
      {"tracks: {signal: tank.level, reference: good.csv, tolerance: 1 m, after_shift: 2 s}",
       "'after_shift': 2 s is more than 1000 base periods, 1 s"},
      {"statistics: {signal: tank.level, mean: {}}", "'mean' needs 'min', 'max' or both"},
      {"statistics: {signal: tank.flow}", "'statistics' needs a limit of at least one figure"},
  });
}

TEST_F(ExpectationMistakes, OfTheWiringAreReportedAtOnce) {
  expect_mistakes({
      {"never: tank.level > 5 s", "'>'"},
      {"never: tank.level > 5 m, after: tank.levle > 1 m", "there is no signal 'tank.levle'"},
      {"never: tank.level > 5 m, until: true", "the condition reads no signal"},
      {"cycle_time: {message: can.car.Stats, period: 10 ms, tolerance: 1 ms}",
       "there is no received message 'can.car.Stats'; did you mean 'can.car.Status'?"},
      {"cycle_time: {message: can.car.Status.Mode, period: 10 ms, tolerance: 1 ms}",
       "'can.car.Status.Mode' is a signal; name its message"},
      {"fresh: tank.level", "'tank.level' does not arrive from a bus or a unit"},
      {"fresh: can.car.Status.Mod", "did you mean 'can.car.Status.Mode'?"},
      {"tracks: {signal: tank.level, reference: good.csv, tolerance: 1 s}",
       "'tolerance' is in m; this is in s"},
      {"tracks: {signal: tank.level, reference: good.csv, tolerance: 0 m}",
       "'tolerance': '0 m' is not above 0"},
      {"tracks: {signal: tank.level, reference: good.csv, tolerance: tank.level}", "is not a constant"},
      {"tracks: {signal: tank.level, reference: late.csv, tolerance: 1 m}",
       "the reference lasts from 10 s to 20 s, which is no tick of the run"},
      {"statistics: {signal: tank.level, mean: {min: 3 m, max: 200 cm}}",
       "'max': '200 cm' is less than 'min', '3 m'"},
      {"statistics: {signal: tank.level, largest: {max: 3 kg}}", "'max' is in m; this is in kg"},
      {"statistics: {signal: tank.level, overshoot: {of: 1 m, from: 100 cm, at_most: 5 %}}",
       "'from': '100 cm' is the final value, so there is no step"},
  });
}

TEST_F(ExpectationMistakes, OfGoodOnesThereAreNone) {
  const std::string text =
      scenario +
      "  - {name: a, fresh: can.car.Status, between: [1 s, 10 s]}\n"
      "  - {name: b, cycle_time: {message: can.car.Status, period: 10 ms, tolerance: 1 ms}}\n"
      "  - {name: c, tracks: {signal: tank.level, reference: two.csv, column: level, tolerance: 10 cm, "
      "after_shift: 50 ms}}\n"
      "  - {name: d, statistics: {signal: tank.level, rms: {max: 3 m}}, after: tank.level > 1 m}\n";
  EXPECT_TRUE(wired(text)) << diagnostics_.to_text();
}

TEST_F(ExpectationMistakes, ReferenceOfARunWithoutAnEndIsNone) {
  const std::string endless =
      changed("duration: 10 s\n", "", scenario) +
      "  - {name: e, tracks: {signal: tank.level, reference: good.csv, tolerance: 1 m}}\n";
  EXPECT_TRUE(wired(endless)) << diagnostics_.to_text();
}

}  // namespace
}  // namespace hil::expectations
