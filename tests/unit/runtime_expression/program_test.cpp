// What compiled expressions evaluate to: units, truths, unknown values, and their mistakes.

#include "runtime/expression/program.hpp"

#include <random>
#include <set>
#include <tuple>
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

/// As `is_difference` of a tolerance.
double difference_of(const std::string& written, const std::string& unit = "K") {
  return compile(written, {.unit = unit, .is_difference = true})->evaluate(test::Names().values(), 1.5);
}

TEST(Program, NumbersInDegreesArePointsOrDifferences) {
  EXPECT_NEAR(value_of("t + 5 degC", "degC"), 25.0, 1e-9);
  EXPECT_NEAR(value_of("5 degC + t", "degC"), 25.0, 1e-9);
  EXPECT_NEAR(value_of("20 degC + 50 K", "degC"), 70.0, 1e-9);
  EXPECT_NEAR(value_of("20 degC + 5 degC", "degC"), 25.0, 1e-9);
  EXPECT_NEAR(value_of("t + 9 degF", "degC"), 25.0, 1e-9);
  EXPECT_NEAR(value_of("t - 20 degC", "K"), 0.0, 1e-9);
  EXPECT_NEAR(value_of("t - u", "K"), 10.0, 1e-9);
  EXPECT_NEAR(value_of("t + (t - u)", "degC"), 30.0, 1e-9);
  EXPECT_NEAR(value_of("2 * (t - u) + t", "degC"), 40.0, 1e-9);
  EXPECT_NEAR(value_of("k - t", "K"), 6.85, 1e-9) << "a value in K is a point where one is needed";
  EXPECT_NEAR(value_of("k", "degC"), 26.85, 1e-9);
  EXPECT_NEAR(value_of("2 * k", "degC"), 326.85, 1e-9);
  EXPECT_EQ(truth_of("t - u < 11 degC and t - u > 9 degC"), 1.0);
  EXPECT_EQ(truth_of("abs(t - u) < 5 degC or -5 degC > t - u"), 0.0);
  EXPECT_EQ(truth_of("max(t - u, 5 degC, 12 degC) > 11 K"), 1.0) << "all are differences";
  EXPECT_EQ(truth_of("max(5 degC, 12 degC, t - u) < 13 degC"), 1.0);
  EXPECT_EQ(truth_of("max(t, 5 degC, 12) > 19 degC and min(t, 5 degC, 12) < 6 degC"), 1.0)
      << "all are points";
  EXPECT_EQ(truth_of("(if a == 1 then 5 degC else 7 degC) < t - u"), 1.0);
  EXPECT_EQ(truth_of("k > 26 degC and k < 27 degC"), 1.0);
  EXPECT_EQ(truth_of("rise < 9 degC and rise > 7 degC"), 1.0) << "a variable remains a difference";
  EXPECT_EQ(truth_of("abs(noise(2 degC)) < 50 K and noise(2 degC) + t > -30 degC"), 1.0);
  EXPECT_NEAR(value_of("t * 1 W/K", "W"), 293.15, 1e-9) << "products with a unit use kelvin";
  EXPECT_NEAR(difference_of("5 degC"), 5.0, 1e-9);
  EXPECT_NEAR(difference_of("-9 degF"), -5.0, 1e-9);
  EXPECT_NEAR(difference_of("if a == 1 then 5 degC else 7 degC"), 5.0, 1e-9);
  EXPECT_NEAR(difference_of("max(5 degC, 7 degC)"), 7.0, 1e-9);
  EXPECT_EQ(difference_of("5"), 5.0);
  EXPECT_EQ(difference_of("k"), 300.0);
  EXPECT_EQ(difference_of("5 cm", "m"), 0.05);
}

/// A temperature of a random expression: its kind by the table of the guide, and its value in K.
struct TemperatureOf {
  std::string text;
  char kind = 'r';  ///< p point, d difference, k in K, n number in degrees, r refused, c computed in K
  double kelvin = 0.0;
  double as_difference = 0.0;  ///< n
  bool is_number = false;
};

TemperatureOf random_leaf(std::mt19937& random) {
  switch (random() % 6) {
    case 0:
      return {"t", 'p', 293.15};
    case 1:
      return {"u", 'p', 283.15};
    case 2:
      return {"k", 'k', 300.0};
    case 3:
      return {"5 degC", 'n', 278.15, 5.0};
    case 4:
      return {"9 degF", 'n', (9.0 + 459.67) / 1.8, 5.0};
    default:
      return {"3 K", 'k', 3.0, 3.0, true};
  }
}

TemperatureOf sum_of(const TemperatureOf& a, const TemperatureOf& b, bool is_sum) {
  TemperatureOf result{.text = "(" + a.text + (is_sum ? " + " : " - ") + b.text + ")"};
  if (a.kind == 'r' || b.kind == 'r') return result;
  const bool a_is_point = a.kind == 'p' || a.kind == 'n', b_is_point = b.kind == 'p' || b.kind == 'n';
  const double sign = is_sum ? 1.0 : -1.0;
  result.kelvin = a.kelvin + sign * b.kelvin;
  if (is_sum) {
    if (a.kind == 'p' && b.kind == 'p') return result;
    if (a_is_point && b.kind == 'n') result.kelvin = a.kelvin + b.as_difference;
    if (a.kind == 'n' && b.kind == 'p') result.kelvin = a.as_difference + b.kelvin;
    if (a_is_point || b_is_point) result.kind = 'p';
  } else {
    if (a.kind == 'd' && b_is_point) return result;
    if (b_is_point)
      result.kind = 'd';
    else if (a_is_point)
      result.kind = 'p';
  }
  if (result.kind != 'r') return result;
  const bool is_difference =
      is_sum ? (a.kind == 'd' && (b.kind == 'd' || b.is_number)) || (b.kind == 'd' && a.is_number)
             : a.kind == 'd';
  result.kind = is_difference ? 'd' : (is_sum ? a.kind == 'k' && b.kind == 'k' : b.is_number) ? a.kind : 'c';
  return result;
}

TEST(Program, RandomTemperaturesFollowTheTableOfTheGuide) {
  std::mt19937 random(11);
  int computed = 0, refused = 0;
  const auto tree = [&](auto&& self, int depth) -> TemperatureOf {
    if (depth == 0 || random() % 4 == 0) return random_leaf(random);
    const TemperatureOf a = self(self, depth - 1), b = self(self, depth - 1);
    return sum_of(a, b, random() % 2 == 0);
  };
  for (int i = 0; i < 3000; ++i) {
    const TemperatureOf a = tree(tree, 2), b = tree(tree, 1);
    // As a point, as a difference, and in a comparison with another one.
    for (const bool is_difference : {false, true}) {
      std::string text;
      config::Diagnostics ignored;
      auto found =
          compile(a.text, {.unit = is_difference ? "K" : "degC", .is_difference = is_difference}, &text);
      const bool is_sound = a.kind != 'r' && a.kind != (is_difference ? 'p' : 'd');
      ASSERT_EQ(found.has_value(), is_sound) << a.text << " " << a.kind << " " << is_difference << text;
      refused += is_sound ? 0 : 1;
      if (!found) continue;
      ++computed;
      const double expected =
          is_difference ? (a.kind == 'n' ? a.as_difference : a.kelvin) : a.kelvin - 273.15;
      ASSERT_NEAR(found->evaluate(test::Names().values(), 0.0), expected, 1e-9) << a.text;
    }
    std::string text;
    auto found = compile(a.text + " < " + b.text, {.truth = true}, &text);
    const auto pair = [&](char one, char other) {
      return (a.kind == one && b.kind == other) || (a.kind == other && b.kind == one);
    };
    const bool is_sound = a.kind != 'r' && b.kind != 'r' && !pair('p', 'd') && !pair('n', 'c');
    ASSERT_EQ(found.has_value(), is_sound) << a.text << " < " << b.text << " " << a.kind << b.kind << text;
    if (!found) continue;
    const double left = pair('n', 'd') && a.kind == 'n' ? a.as_difference : a.kelvin;
    const double right = pair('n', 'd') && b.kind == 'n' ? b.as_difference : b.kelvin;
    if (std::abs(left - right) <= 1e-6) continue;
    ASSERT_EQ(found->evaluate(test::Names().values(), 0.0), left < right ? 1.0 : 0.0)
        << a.text << " < " << b.text;
  }
  EXPECT_GT(computed, 1000);
  EXPECT_GT(refused, 1000);
}

TEST(Program, RatesConvertBetweenTurnsRadiansAndCyclesOrAreRefused) {
  const double turn = 2.0 * std::acos(-1.0);
  EXPECT_EQ(value_of("3000 rpm", "rpm"), 3000.0) << "not by way of the SI";
  EXPECT_EQ(value_of("n", "1/min"), 600.0);
  EXPECT_EQ(value_of("n", "Hz"), 10.0);
  EXPECT_DOUBLE_EQ(value_of("n", "rad/s"), 10.0 * turn);
  EXPECT_DOUBLE_EQ(value_of("w", "rpm"), 2.0 * 60.0 / turn);
  EXPECT_EQ(truth_of("n == 10 Hz and n == f and n == 600 1/min and 10 Hz == n"), 1.0);
  EXPECT_EQ(truth_of("n > 62 rad/s and n < 63 rad/s and n > 3599 deg/s and n < 3601 deg/s"), 1.0);
  EXPECT_EQ(truth_of("max(n, f, 12 Hz) == 12 Hz or max(n, w) < 10 rad/s"), 1.0);
  EXPECT_NEAR(value_of("abs(n - 9 Hz)", "Hz"), 1.0, 1e-12);
  EXPECT_NEAR(value_of("2 * n", "Hz"), 20.0, 1e-12);
  EXPECT_DOUBLE_EQ(value_of("v / x", "rad/s"), 10.0 / 3.0);
  EXPECT_DOUBLE_EQ(value_of("v / x", "Hz"), 10.0 / 3.0);
  EXPECT_DOUBLE_EQ(value_of("1 / dt", "Hz"), 2.0);
  EXPECT_DOUBLE_EQ(value_of("1 / dt * 1 rev", "rpm"), 120.0);
  EXPECT_DOUBLE_EQ(value_of("v / x * 1 rad", "rpm"), 10.0 / 3.0 / turn * 60.0);
  EXPECT_DOUBLE_EQ(value_of("w / 1 rev", "Hz"), 2.0 / turn);
  EXPECT_DOUBLE_EQ(value_of("f * 1 rev", "rad/s"), 10.0 * turn);
  EXPECT_DOUBLE_EQ(value_of("n / 1 rev", "Hz"), 10.0);
  EXPECT_DOUBLE_EQ(value_of("3 N m * w", "W"), 6.0);
  EXPECT_DOUBLE_EQ(value_of("3 N m * n / 1 rad", "W"), 3.0 * 10.0 * turn);
  EXPECT_DOUBLE_EQ(value_of("0.1 V s/rad * n", "V"), turn);
  EXPECT_DOUBLE_EQ(value_of("100 rpm/V * 12 V", "rpm"), 1200.0);
  EXPECT_DOUBLE_EQ(value_of("2 l/rev * n", "l/s"), 20.0);
  EXPECT_DOUBLE_EQ(value_of("2 l * n / 1 rev", "l/s"), 20.0);
  EXPECT_DOUBLE_EQ(value_of("w * x", "m/s"), 6.0);
  EXPECT_DOUBLE_EQ(value_of("n * dt", "rev"), 5.0);
  EXPECT_DOUBLE_EQ(value_of("1 rev / n", "ms"), 100.0);
  EXPECT_DOUBLE_EQ(value_of("rate", "rad/s"), 4.0);
  EXPECT_DOUBLE_EQ(value_of("rate", "Hz"), 4.0);
  EXPECT_EQ(compile("v / x * 1 rad", {.unit = std::nullopt})->unit(), "rad/s");
  EXPECT_EQ(compile("v / x", {.unit = std::nullopt})->unit(), "1/s");
  EXPECT_EQ(compile("v / x", {.unit = std::nullopt})->value_kind(), units::ValueKind::open);
  EXPECT_EQ(compile("t - u", {.unit = std::nullopt})->value_kind(), units::ValueKind::difference);
  EXPECT_EQ(compile("f", {.unit = std::nullopt})->value_kind(), units::ValueKind::as_unit);
  EXPECT_EQ(compile("3 N m * n", {.unit = std::nullopt})->unit(), "rev kg m2/s3");
  EXPECT_EQ(compile("n * dt", {.unit = std::nullopt})->unit(), "rev");
  for (const char* condition :
       {"w > f", "w == 2 1/s", "v / x > n", "rate < 5 rpm", "3 N m * n > 5 W", "2 l * n > 1 l/s",
        "1 / n > 1 s", "max(v / x, w, f) > 1 Hz", "f * 2 > w", "max(w, n) > f", "2 l/rev > 1 l"}) {
    std::string text;
    EXPECT_FALSE(compile(condition, {.truth = true}, &text)) << condition;
    EXPECT_NE(text.find("1 rev"), std::string::npos) << "says what to write: " << text;
  }
}

/// A number of cycles, as whatever leaves what it is.
std::string random_cycles(std::mt19937& random, int depth) {
  const char* const leaves[] = {"f * dt",        "dt * f",      "integral(f)", "integral(f, a == 2)",
                                "60 1/min * dt", "time * 2 Hz", "cycles"};
  if (depth == 0) return leaves[random() % std::size(leaves)];
  const char* const wholes[] = {"2 * (%)",
                                "(%) * 3",
                                "(%) / 4",
                                "(%) + 1",
                                "1 - (%)",
                                "abs(%)",
                                "min(%, 9)",
                                "max(9, %)",
                                "previous(%)",
                                "hold(%, a == 1)",
                                "-(%)",
                                "lag(%, 1 s)",
                                "clamp(%, 0, 9)",
                                "if a == 1 then % else 0",
                                "delay(%, 100 ms)",
                                "(%) + f * dt"};
  std::string text = wholes[random() % std::size(wholes)];
  const std::string inner = random_cycles(random, depth - 1);
  return text.replace(text.find('%'), 1, inner);
}

TEST(Program, CyclesTimesATimeAreNoAngle) {
  std::mt19937 random(909);
  const char* const angles[] = {
      "3 rev", "90 deg", "angle", "n * dt", "w * dt", "1 rad", "(rate * 1 rad) * dt"};
  for (int round = 0; round < 300; ++round) {
    const std::string cycles = random_cycles(random, static_cast<int>(random() % 4));
    for (const char* const angle : angles) {
      for (const std::string& condition :
           {"(" + cycles + ") < " + angle, std::string(angle) + " >= (" + cycles + ")"}) {
        std::string text;
        EXPECT_FALSE(compile(condition, {.truth = true}, &text)) << condition;
        EXPECT_NE(text.find("multiply it by 1 rev"), std::string::npos) << condition << "\n" << text;
      }
    }
    for (const char* const unit : {"rev", "deg", "rad"}) {
      std::string text;
      EXPECT_FALSE(compile(cycles, {.unit = unit, .what = "'x'"}, &text)) << cycles << unit;
      EXPECT_TRUE(compile("(" + cycles + ") * 1 rev", {.unit = unit})) << cycles << unit;
      EXPECT_TRUE(compile("(" + cycles + ") * 1 rad", {.unit = unit})) << cycles << unit;
    }
    EXPECT_TRUE(compile("(" + cycles + ") < 3", {.truth = true})) << cycles;
    EXPECT_TRUE(compile("sin(" + cycles + ") < 3", {.truth = true})) << cycles;
    EXPECT_EQ(compile(cycles, {.unit = std::nullopt})->value_kind(), units::ValueKind::open)
        << cycles << ": a variable keeps what it is";
  }
  std::string share;
  EXPECT_FALSE(compile("f * dt * share < 90 deg", {.truth = true}, &share));
  EXPECT_DOUBLE_EQ(value_of("f * dt * 1 rev", "rev"), 5.0);
  EXPECT_DOUBLE_EQ(value_of("f * dt * 1 rad", "rad"), 5.0);
  EXPECT_DOUBLE_EQ(value_of("f * dt"), 5.0);
  EXPECT_DOUBLE_EQ(value_of("cycles / dt", "Hz"), 6.0);
  for (const char* const condition : {"w * dt < 90 deg", "n * dt < 3 rev", "rate * dt < 90 deg",
                                      "v / x * dt < 90 deg", "f / 2 Hz < 3", "integral(n) < 3 rev"})
    EXPECT_TRUE(compile(condition, {.truth = true})) << condition;
}

TEST(Program, FunctionsOfNumbersRefuseSharesAndAngles) {
  const auto written = [](const std::string& function, const std::string& argument) {
    return function + "(" + argument + ") > 1";
  };
  for (const char* const function : {"round", "floor", "ceil", "exp", "ln", "log10"}) {
    for (const auto& [argument, unit] : {std::pair{"share", "%"},
                                         {"angle", "deg"},
                                         {"2 * share", "%"},
                                         {"abs(angle)", "deg"},
                                         {"-share", "%"},
                                         {"5 %", "%"},
                                         {"1 rad", "rad"},
                                         {"w * dt", "rad"},
                                         {"n * dt", "rev"},
                                         {"kmh", "km/h"},
                                         {"v", "m/s"},
                                         {"share + 1 %", "%"},
                                         {"min(share, 5 %)", "%"}}) {
      std::string text;
      EXPECT_FALSE(compile(written(function, argument), {.truth = true}, &text)) << function << argument;
      const std::string unit_text = unit;
      EXPECT_NE(text.find("needs a plain number; this is in " + unit_text + "; divide it by 1 " + unit_text),
                std::string::npos)
          << function << argument << "\n"
          << text;
      EXPECT_TRUE(
          compile(written(function, "(" + std::string(argument) + ") / 1 " + unit_text), {.truth = true}))
          << function << argument;
    }
    for (const char* const argument : {"a", "2", "a * 2", "v / x * dt", "share / 1 %", "v / 1 km/h", "sin(a)",
                                       "count(a == 1)", "raw_share", "cycles", "sqrt(a)"})
      EXPECT_TRUE(compile(written(function, argument), {.truth = true})) << function << argument;
  }
  EXPECT_EQ(value_of("round(share / 1 %)"), 50.0);
  EXPECT_EQ(value_of("round(angle / 1 deg)"), 90.0);
  EXPECT_EQ(value_of("round(share / 100 %)"), 1.0);
}

TEST(Program, ASignalWithoutAUnitIsWarnedOfWhereTheResultHasOne) {
  for (const auto& [written, unit, warns] : {std::tuple{"raw_share", "%", true},
                                             {"raw_share", "deg", true},
                                             {"abs(raw_share)", "%", true},
                                             {"previous(raw_share)", "%", true},
                                             {"-raw_share", "%", true},
                                             {"raw_share", "1", false},
                                             {"raw_share", "", false},
                                             {"raw_share", "rad", false},
                                             {"a", "%", false},
                                             {"share", "%", false}}) {
    std::string text;
    EXPECT_TRUE(compile(written, {.unit = unit, .what = "'x'"}, &text));
    EXPECT_EQ(text.find("'raw_share' has no unit, so it is in the SI") != std::string::npos, warns)
        << written << " " << unit << text;
  }
}

/// A random rate: what it counts (t turns, r radians, c cycles, o open), with turns and radians in rad/s.
struct RateOf {
  std::string text;
  char kind = 'o';
  double per_second = 0.0;
};

RateOf random_rate(std::mt19937& random, int depth) {
  const double turn = 2.0 * std::acos(-1.0);
  const RateOf leaves[] = {{"n", 't', 10.0 * turn},
                           {"w", 'r', 2.0},
                           {"f", 'c', 10.0},
                           {"rate", 'o', 4.0},
                           {"v / x", 'o', 10.0 / 3.0},
                           {"90 rpm", 't', 1.5 * turn},
                           {"30 deg/s", 'r', turn / 12.0},
                           {"90 1/min", 'c', 1.5},
                           {"1 / dt", 'o', 2.0}};
  RateOf rate = leaves[random() % std::size(leaves)];
  for (; depth > 0; --depth) {
    const bool has_angle = rate.kind == 't' || rate.kind == 'r';
    const bool is_turn = random() % 2 == 0;
    if (random() % 3 == 0) {
      rate = {"2 * (" + rate.text + ")", rate.kind, 2.0 * rate.per_second};
    } else if (has_angle) {
      rate = {"(" + rate.text + (is_turn ? ") / 1 rev" : ") / 1 rad"), 'o',
              rate.per_second / (is_turn ? turn : 1.0)};
    } else {
      rate = {"(" + rate.text + (is_turn ? ") * 1 rev" : ") * 1 rad"), is_turn ? 't' : 'r',
              rate.per_second * (is_turn ? turn : 1.0)};
    }
  }
  return rate;
}

TEST(Program, RandomRatesFollowTheTableOfTheGuide) {
  std::mt19937 random(31);
  const double turn = 2.0 * std::acos(-1.0);
  const std::set<std::string> refused{"rc", "cr", "ot", "to"};
  int found_ones = 0, refused_ones = 0;
  for (int i = 0; i < 2000; ++i) {
    const RateOf a = random_rate(random, static_cast<int>(random() % 4));
    const RateOf b = random_rate(random, static_cast<int>(random() % 4));
    const auto as = [&](const RateOf& rate, char kind) {  // turns and radians in rad/s
      const bool has_angle = rate.kind == 't' || rate.kind == 'r';
      if (kind == 'c' && rate.kind == 't') return rate.per_second / turn;
      if (kind == 't' && !has_angle) return rate.per_second * turn;
      return rate.per_second;
    };
    const std::tuple<const char*, char, double> wanted[] = {
        {"rpm", 't', 60.0 / turn}, {"deg/s", 'r', 360.0 / turn}, {"1/min", 'c', 60.0}};
    for (const auto& [unit, kind, factor] : wanted) {
      std::string text;
      auto program = compile(a.text, {.unit = unit}, &text);
      ASSERT_EQ(program.has_value(), !refused.contains({a.kind, kind})) << a.text << " in " << unit << text;
      (program ? found_ones : refused_ones) += 1;
      if (!program) continue;
      ASSERT_NEAR(program->evaluate(test::Names().values(), 0.0) / (as(a, kind) * factor), 1.0, 1e-12)
          << a.text << " in " << unit;
    }
    std::string text;
    auto program = compile(a.text + " < " + b.text, {.truth = true}, &text);
    ASSERT_EQ(program.has_value(), !refused.contains({a.kind, b.kind})) << a.text << " < " << b.text << text;
    if (!program) continue;
    // In cycles where one of both counts them; else as they are.
    const bool in_cycles = a.kind == 'c' || b.kind == 'c';
    const double mine = in_cycles ? as(a, 'c') : a.per_second;
    const double other = in_cycles ? as(b, 'c') : b.per_second;
    if (std::abs(mine - other) < 1e-9) continue;
    ASSERT_EQ(program->evaluate(test::Names().values(), 0.0), mine < other ? 1.0 : 0.0)
        << a.text << " < " << b.text;
  }
  EXPECT_GT(found_ones, 2000);
  EXPECT_GT(refused_ones, 500);
}

TEST(Program, ReadsTheUnitsThatSignalsHave) {
  for (const char* unit :
       {"1/s", "1/min", "1/K", "l/100km", "10mV", "100ms", "kWh/100km", "U/min", "deg C", "\u00b0C", "N.m",
        "m s-2", "m*s^-2", "W/m2 K", "1/100km", "%", "0.1degC", "kohm", "m\u00b7s\u207b\u00b2"}) {
    const auto parsed = units::parse_unit(unit);
    ASSERT_TRUE(parsed) << unit;
    config::Diagnostics diagnostics;
    const auto expression = config::Expression::parse({"2 " + std::string(unit) + " + 0 m", {}}, diagnostics);
    ASSERT_TRUE(expression) << unit << diagnostics.to_text();
    ASSERT_TRUE(expression->nodes()[0].unit) << unit;
    EXPECT_TRUE(units::is_same(*expression->nodes()[0].unit, *parsed)) << unit;
  }
  EXPECT_EQ(truth_of("f > 2 1/s and f < 11 1/s"), 1.0);
  EXPECT_DOUBLE_EQ(value_of("0.004 1/K * 10 K"), 0.04);
  EXPECT_DOUBLE_EQ(value_of("8 l/100km", "m2"), 8e-8);
  EXPECT_DOUBLE_EQ(value_of("6 % / (1 km/h)", "% h/km"), 6.0);
  EXPECT_DOUBLE_EQ(value_of("10 m/2", "m"), 5.0) << "a number without a symbol divides";
  EXPECT_DOUBLE_EQ(value_of("10 m/2e3", "m"), 0.005);
  EXPECT_DOUBLE_EQ(value_of("10 m/2s", "m/s"), 5.0);
}

TEST(Program, ProductsOfSharesAndLikeUnitsArePlainNumbers) {
  EXPECT_EQ(truth_of("share / share > 0.9 and share / 100 % < 0.6 and share * share < 0.3"), 1.0);
  EXPECT_EQ(truth_of("share * 2 % / share > 0.5"), 0.0) << "2 % is 0.02";
  EXPECT_EQ(truth_of("1 / share == 2 and 1 - kmh / v == 0 and 1 - v / 72 km/h == 0.5"), 1.0);
  EXPECT_EQ(truth_of("angle / angle == 1 and sqrt(share) < 0.8 and share ^ 2 == 0.25"), 1.0);
  EXPECT_EQ(truth_of("2 * share == 100 and share * 2 * a > 99 and b * share > 99"), 1.0) << "in %";
  EXPECT_EQ(truth_of("(v / kmh) * share == 50"), 1.0);
  EXPECT_EQ(truth_of("share * kmh == 18 and kmh * share == 18"), 1.0) << "in km/h";
  EXPECT_EQ(truth_of("x * angle > 4.7 and x * angle < 4.8"), 1.0) << "an arc, in m";
}

TEST(Program, WarnsOfASignalWithoutAUnitBesideOne) {
  const auto warnings = [](const std::string& written) {
    config::Diagnostics diagnostics;
    const auto expression = config::Expression::parse({written, {}}, diagnostics);
    EXPECT_TRUE(Program::compile(*expression, test::Names(), {.truth = true}, {}, diagnostics))
        << diagnostics.to_text();
    return diagnostics.to_text();
  };
  for (const char* condition : {"raw_share > 50 %", "share < raw_share", "min(raw_share, share) > 5 %"})
    EXPECT_NE(warnings(condition).find("'raw_share' has no unit, so it is in the SI, and 1 is 100 %"),
              std::string::npos)
        << condition;
  EXPECT_NE(warnings("angle > raw_share").find("1 is 57.2958 deg"), std::string::npos);
  for (const char* condition : {"raw_share > 0.5", "raw_share > 1 rad", "a > 50 %"})
    EXPECT_EQ(warnings(condition), "") << condition;
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

TEST(Program, DelaysOfAScenarioAreLimitedTogether) {
  config::Diagnostics diagnostics;
  const auto is_refused = [&](std::uint32_t line, const std::string& delay) {
    const std::size_t before = diagnostics.count();
    const auto expression =
        config::Expression::parse(config::Word{"delay(v, " + delay + ") > 1", {"f", line, 2}}, diagnostics);
    const bool compiled = expression && Program::compile(*expression, test::Names(), {.truth = true},
                                                         {.period_ns = 100'000'000, .seed = 5}, diagnostics);
    EXPECT_EQ(compiled, diagnostics.count() == before);
    return !compiled;
  };
  for (std::uint32_t line = 1; line <= 10; ++line) {
    EXPECT_FALSE(is_refused(line, "100000 s")) << line;  // 10^6 steps
    EXPECT_FALSE(is_refused(line, "100000 s")) << "the same one again";
  }
  EXPECT_FALSE(is_refused(11, "0 s"));
  EXPECT_TRUE(is_refused(12, "100 ms"));
  EXPECT_NE(diagnostics.to_text().find(
                "f:12:11: up to here all delays together have 10000001 steps; 10000000 are possible"),
            std::string::npos)
      << diagnostics.to_text();
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
      {"share * angle == 2",
       "f:1:19: this number needs a unit: the other side of '==' is a share or an "
       "angle, computed from several units; write it in %, deg, rad or rev"},
      {"t - 5 degC > u",
       "f:1:13: '>' has a difference of temperatures and a temperature in degF; a difference is in K"},
      {"t + u > 5 K",
       "f:1:4: temperatures in degC or degF can not be added; write the one that is a difference in K"},
      {"t - u - 5 degC > 1 K",
       "f:1:8: a temperature in degC can not be subtracted from a difference of temperatures"},
      {"2 * t > 5 K", "f:1:4: a temperature in degC times or over a plain number depends on where its"},
      {"t / 2 > 5 K", "f:1:4: a temperature in degC times or over a plain number"},
      {"share * t > 5 K", "f:1:8: a temperature in degC times or over a plain number"},
      {"2 * 5 degC > 5 K", "f:1:4: a temperature in degC times or over a plain number"},
      {"abs(t) > 5 degC", "f:1:2: 'abs' of a temperature in degC depends on where its scale begins"},
      {"pid(t - u, 1, 0, 0, 0 degC, 5 degC) > 5 K",
       "f:1:22: the output of 'pid' is a difference, so its limits can not be in degC; write them in K"},
      {"noise(t) > 5 K", "f:1:8: 'noise' needs a difference of temperatures; this is a temperature in degC"},
      {"5 W * 2 K/W < 50 degC",
       "f:1:14: '<' has a number in degC beside a computed value in K, which may be a temperature or"},
      {"v > 6 %/(km/h)",
       "f:1:11: there is no signal 'km'; a unit has no parentheses: write '/ (1 km/h)' with"},
      {"-t > 5 K", "f:1:2: a temperature in degC has no opposite; use K"},
      {"raw > 5 m", "f:1:6: '>' has operands in steps and m, and 'steps' is not a known unit"},
      {"raw * x > 5", "f:1:6: 'steps' is not a known unit, so '*' has no unit for its result"},
      {"sqrt(x) > 1", "f:1:7: a value in m has no square root, since its unit has none"},
      {"x ^ a > 1", "f:1:4: the exponent of a value in m is a whole number from -100 to 100"},
      {"2 ^ x > 1", "f:1:4: an exponent is a plain number"},
      {"v and a", "f:1:2: 'and' needs a condition; this is a value in m/s"},
      {"a and 1", "f:1:8: 'and' needs a condition; this is a plain number"},
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

TEST(Program, TheResultHasTheRequiredUnit) {
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
