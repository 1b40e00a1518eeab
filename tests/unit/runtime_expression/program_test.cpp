// What compiled expressions evaluate to: units, truths, unknown values, and their mistakes.

#include "runtime/expression/program.hpp"

#include <random>
#include <utility>

#include "compiled.hpp"

namespace hil::expression {
namespace {

using test::compile;
using test::truth_of;
using test::value_of;

bool is_unknown(const std::string& condition) {
  return std::isnan(truth_of(condition));
}

TEST(Program, ComputesNumbers) {
  EXPECT_EQ(value_of("1 + 2 * 3 - 4 / 2"), 5.0);
  EXPECT_EQ(value_of("-2 ^ 2"), -4.0);
  EXPECT_EQ(value_of("2 ^ 3 ^ 2"), 512.0) << "from right to left";
  EXPECT_EQ(value_of("a + b"), 3.0);
  EXPECT_EQ(value_of("if a == 1 then b else 7"), 2.0);
  EXPECT_EQ(value_of("if a == 2 then b else 7"), 7.0);
  EXPECT_EQ(value_of("time + 1", "s"), 2.5);
  EXPECT_EQ(value_of("a == 1"), 1.0) << "true as a number";
}

TEST(Program, ConvertsUnits) {
  EXPECT_EQ(value_of("v", "km/h"), 36.0);
  EXPECT_EQ(value_of("kmh + v", "m/s"), 20.0);
  EXPECT_EQ(value_of("x / dt", "m/s"), 6.0);
  EXPECT_EQ(value_of("x / dt", "km/h"), 21.6);
  EXPECT_EQ(value_of("sqrt(2 * 9.81 m/s2 * x)", "m/s"), std::sqrt(2.0 * 9.81 * 3.0));
  EXPECT_EQ(value_of("x ^ 2 * 10 N/m2", "N"), 90.0);
  EXPECT_EQ(value_of("share * x", "m"), 1.5);
  EXPECT_EQ(value_of("share", "%"), 50.0);
  EXPECT_EQ(value_of("180 deg", "rad"), std::acos(-1.0));
  EXPECT_EQ(value_of("raw + 1", "steps"), 8.0);
  EXPECT_EQ(value_of("2 * raw", "steps"), 14.0);
}

TEST(Program, ANumberWithoutAUnitTakesThatBesideIt) {
  EXPECT_EQ(truth_of("kmh > 35"), 1.0);
  EXPECT_EQ(truth_of("kmh > 37"), 0.0);
  EXPECT_EQ(truth_of("kmh == 36 and 36 == kmh"), 1.0);
  EXPECT_EQ(truth_of("v > 9 and v < 11"), 1.0);
  EXPECT_EQ(truth_of("kmh == 10 m/s"), 1.0);
  EXPECT_EQ(truth_of("2 * kmh == 72"), 1.0);
  EXPECT_EQ(truth_of("kmh + 4 == 40"), 1.0);
  EXPECT_EQ(truth_of("2 * share == 100 and share * 2 == 100 and share / 2 == 25"), 1.0);
  EXPECT_EQ(truth_of("1 / share == 200 %"), 1.0);
  EXPECT_EQ(truth_of("x / dt < 7"), 1.0) << "both in the SI";
  EXPECT_EQ(truth_of("max(1, kmh, 2) == 36 and min(99, 98, kmh) == 36"), 1.0);
  EXPECT_EQ(value_of("if a == 1 then 5 else kmh", "km/h"), 5.0);
  EXPECT_EQ(value_of("7", "km/h"), 7.0) << "the result's unit";
  EXPECT_EQ(value_of("2 * 3 + 1", "km/h"), 7.0);
}

TEST(Program, TemperaturesAreValuesOrDifferences) {
  EXPECT_EQ(truth_of("t > 19 and t < 21"), 1.0);
  EXPECT_EQ(truth_of("t == 20 degC and t > -20 degC"), 1.0);
  EXPECT_DOUBLE_EQ(value_of("t", "K"), 293.15);
  EXPECT_DOUBLE_EQ(value_of("t - 5 degC", "K"), 15.0);
  EXPECT_EQ(truth_of("t - 5 degC > 14 K and t - 5 degC < 16 K"), 1.0);
  EXPECT_NEAR(value_of("t + 5 K", "degC"), 25.0, 1e-12);
}

TEST(Program, JoinsTruths) {
  EXPECT_EQ(truth_of("a == 1 or a == 9 and a == 8"), 1.0);
  EXPECT_EQ(truth_of("(a == 1 or a == 9) and a == 8"), 0.0);
  EXPECT_EQ(truth_of("not a == 2 and b == 2"), 1.0);
  EXPECT_EQ(truth_of("a"), 1.0) << "not 0";
  EXPECT_EQ(truth_of("not b"), 0.0);
  EXPECT_EQ(truth_of("a and true"), 1.0);
  EXPECT_EQ(truth_of("if a == 1 then false else true"), 0.0);
}

TEST(Program, IsUnknownWhereAnUnknownValueDecides) {
  for (const char* condition :
       {"lost == 1", "lost != 1", "a == lost", "not lost == 1", "a == 1 and lost == 1", "a == 2 or lost == 1",
        "lost", "lost == 1 or lost != 1", "a / 0 > 1", "sqrt(-a) == 1", "min(a, lost) < 5",
        "max(lost, a) > 0", "rise(lost > 1)"})
    EXPECT_TRUE(is_unknown(condition)) << condition;
  EXPECT_EQ(truth_of("lost == 1 and a == 2"), 0.0);
  EXPECT_EQ(truth_of("lost == 1 or a == 1"), 1.0);
  EXPECT_EQ(truth_of("known(a) and not known(lost)"), 1.0);
  EXPECT_TRUE(std::isnan(value_of("lost + 1")));
  EXPECT_TRUE(std::isnan(value_of("if lost == 1 then a else b")));
  EXPECT_EQ(value_of("if known(lost) then lost else b"), 2.0);
}

TEST(Program, ReadsNamesOfValues) {
  EXPECT_EQ(truth_of("state == red and state != green"), 1.0);
  EXPECT_EQ(truth_of("'red' == state"), 1.0);
  EXPECT_EQ(truth_of("green < state"), 1.0);
}

TEST(Program, MistakesAreAllReportedAtTheirPlaces) {
  const std::pair<const char*, const char*> mistakes[] = {
      {"v > 3 s", "f:1:4: '>' has operands in m/s and s"},
      {"v + x > 1", "f:1:4: '+' has operands in m/s and m"},
      {"kmh * x > 5",
       "f:1:12: this number needs a unit: the other side of '>' is in m2/s, computed from several "
       "units"},
      {"t + 5 > 1 K",
       "f:1:6: this number needs a unit: with degC it may be a temperature or a difference (K)"},
      {"1 / share == 2", "f:1:15: this number needs a unit: the other side of '==' is in 1"},
      {"t - 5 degC > 3 degC",
       "f:1:13: '>' has a difference of temperatures and a temperature in degC; a difference is in K"},
      {"-t > 5 K", "f:1:2: a temperature in degC has no opposite; use K"},
      {"raw > 5 m", "f:1:6: '>' has operands in steps and m, and 'steps' is not a known unit"},
      {"raw * x > 5", "f:1:6: 'steps' is not a known unit, so '*' has no unit for its result"},
      {"sqrt(x) > 1", "f:1:7: a value in m has no square root, since its unit has none"},
      {"x ^ a > 1", "f:1:4: the exponent of a value in m is a whole number from -100 to 100"},
      {"2 ^ x > 1", "f:1:4: an exponent is a plain number"},
      {"v and a", "f:1:2: 'and' needs a condition; this is a value in m/s"},
      {"a and 1", "f:1:8: 'and' needs a condition; this is a value in a plain number"},
      {"(a == 1) + 1 > 1", "f:1:5: this is true or false, and '+' needs numbers; use if ... then 1 else 0"},
      {"speed > 1", "f:1:2: there is no signal 'speed'; known here: a, b"},
      {"sin > 1", "f:1:2: the function 'sin' needs its arguments in parentheses"},
      {"sine(a) > 1", "f:1:2: there is no function 'sine'; did you mean 'sin'?"},
      {"sin(v) > 1", "f:1:6: 'sin' needs a plain number; this is in m/s"},
      {"clamp(a, b) > 1", "f:1:2: 'clamp' has 2 arguments, but takes (x, low, high)"},
      {"delay(v, a) > 1", "f:1:11: 'delay' needs a duration, as '20 ms'"},
      {"delay(v, dt) > 1", "f:1:11: 'delay' needs a constant duration, as '20 ms'"},
      {"delay(v, 150 ms) > 1",
       "f:1:11: a delay of 0.15 s is 1.5 steps of 0.1 s; use a whole number of steps"},
      {"delay(v, 9 d) > 1", "steps of 0.1 s; 0 to 1000000 are possible"},
      {"rate_limit(v, 3 m) > 1", "f:1:16: 'rate_limit' needs a change of m/s per second"},
      {"state == blue", "f:1:11: 'blue' is no number and no signal, and 'state' has no value of that name"},
      {"b == blue", "f:1:7: 'blue' is no number and no signal, and 'b' has no value names"},
      {"b == kmhh", "f:1:7: there is no signal 'kmhh'; did you mean 'kmh'?"},
      {"state == same", "f:1:11: 'state' has several values with the name 'same'; use the number"},
      {"a == 'red'", "f:1:7: 'a' has no value names"},
      {"1 == 'red'", "f:1:7: the value name 'red' is not compared with a value that has names"},
      {"v", "f:1:2: the condition has to be true or false; this is a value in m/s"},
  };
  for (const auto& [written, text] : mistakes) {
    std::string found;
    EXPECT_FALSE(compile(written, {.truth = true, .what = "the condition"}, &found)) << written;
    EXPECT_NE(found.find(text), std::string::npos) << written << "\n" << found;
    EXPECT_EQ(std::count(found.begin(), found.end(), '\n'), 1) << found;
  }
  std::string both;
  EXPECT_FALSE(compile("v > 3 s or speed > 1", {.truth = true}, &both));
  EXPECT_EQ(std::count(both.begin(), both.end(), '\n'), 2) << both;
  std::string none;
  EXPECT_FALSE(compile("broken.signal > 1", {.truth = true}, &none));
  EXPECT_EQ(none, "") << "its part has a mistake already";
}

TEST(Program, TheResultHasTheWantedUnit) {
  std::string text;
  EXPECT_FALSE(compile("v * 1 s", {.unit = "m/s", .what = "'speed'"}, &text));
  EXPECT_NE(text.find("'speed' is in m/s; this is in m"), std::string::npos) << text;
  EXPECT_FALSE(compile("a == 1", {.unit = "m/s", .what = "'speed'"}, &text));
  EXPECT_NE(text.find("'speed' is in m/s; this is true or false"), std::string::npos) << text;
  EXPECT_FALSE(compile("raw", {.unit = "m", .what = "'x'"}, &text));
  EXPECT_NE(text.find("'x' is in m; this is in steps"), std::string::npos) << text;
}

TEST(Program, KnowsItsVariables) {
  EXPECT_EQ(compile("v > 1 and a == 1 or v < 0", {.truth = true})->variables(),
            (std::vector<std::uint32_t>{0, 3}));
  EXPECT_TRUE(compile("1 < 2", {.truth = true})->variables().empty());
}

/// Random conditions against their value by the language's own operators.
struct Expected {
  std::string text;
  bool holds = false;
};

Expected random_condition(std::mt19937& random, int depth, double a, double b) {
  if (depth == 0 || random() % 3 == 0) {
    const int number = static_cast<int>(random() % 5) - 2;
    switch (random() % 4) {
      case 0:
        return {"a < " + std::to_string(number), a < number};
      case 1:
        return {"b + 1 >= " + std::to_string(number), b + 1 >= number};
      case 2:
        return {"a == b", a == b};
      default:
        return {std::to_string(number) + " != 2 * a", number != 2 * a};
    }
  }
  const Expected left = random_condition(random, depth - 1, a, b);
  if (random() % 4 == 0) return {"not (" + left.text + ")", !left.holds};
  const Expected right = random_condition(random, depth - 1, a, b);
  if (random() % 2 == 0) return {"(" + left.text + ") and (" + right.text + ")", left.holds && right.holds};
  return {"(" + left.text + ") or (" + right.text + ")", left.holds || right.holds};
}

TEST(Program, RandomConditionsHaveTheExpectedResult) {
  std::mt19937 random(7);
  int true_ones = 0;
  for (int i = 0; i < 500; ++i) {
    const double a = static_cast<double>(random() % 5) - 2.0;
    const double b = static_cast<double>(random() % 5) - 2.0;
    const Expected expected = random_condition(random, 4, a, b);
    std::vector<double> values = test::Names().values();
    values[0] = a;
    values[1] = b;
    ASSERT_EQ(compile(expected.text, {.truth = true})->evaluate(values, 0.0), expected.holds ? 1.0 : 0.0)
        << expected.text << " a " << a << " b " << b;
    true_ones += expected.holds ? 1 : 0;
  }
  EXPECT_GT(true_ones, 100);
  EXPECT_LT(true_ones, 400);
}

TEST(Program, MisuseIsAsserted) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  auto program = compile("b > 1", {.truth = true});
  const std::vector<double> one{1.0};
  EXPECT_DEATH(program->evaluate(one, 0.0), "a value for each variable");
}

}  // namespace
}  // namespace hil::expression
