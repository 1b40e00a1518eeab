// The functions of expressions, step by step. A step is 0.1 s.

#include "runtime/expression/function.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>

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
  expect_near(steps("rise(a > 1)", {2, 0, 2, 2, 0}), {0, 0, 1, 0, 0});
  expect_near(steps("fall(a > 1)", {2, 0, 2, 2, 0}), {0, 1, 0, 0, 1});
  expect_near(steps("changed(a)", {2, 2, 3, 3}), {0, 0, 1, 0});
  expect_near(steps("rise(a > 1)", {0, unknown, 2, 0}), {0, unknown, 1, 0});
  expect_near(steps("count(a > 1)", {2, 0, 2, 0, 2}), {0, 0, 1, 1, 2});
  expect_near(steps("count(a > 1, a < 0)", {0, 2, -1, 2}), {0, 1, 0, 1});
  expect_near(steps("latch(a > 1, a < 0)", {0, 2, 0, -1, 0}), {0, 1, 1, 0, 0});
  expect_near(steps("duration(a > 1)", {2, 2, 2, 0, 2}, "s"), {0, 0.1, 0.2, 0, 0});
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
