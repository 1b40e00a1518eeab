// Expressions with random damage: each is refused with a mistake in it, or evaluated.

#include <array>

#include "compiled.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/text_mutator.hpp"

namespace hil::expression {
namespace {

constexpr std::array originals{
    "v > 50 km/h and not (state == red or lost <= 2.5) or raw != -1e3",
    "if duration(x > 2 m) > 200 ms then clamp(kmh, 3 m/s, 90) else lag(v, dt, 0)",
    "sqrt(2 * 9.81 m/s2 * x) + delay(v, 0.3 s) * share ^ 2 - derivative(x) / count(rise(a))",
    "pid(t - 20 degC, 2 W/K, 0.1 W/K/s, 0 J/K, 0 W, 2 kW) / 1 W + noise(a) + mod(-b, 3)",
};

TEST(Mutation, OfExpressionsNeverCrashes) {
  const config::Schema schema =
      config::Schema::record({config::Field::needed("c", config::Schema::text(), "A condition.")});
  const test::Names names;
  std::uint64_t compiled = 0;
  const std::uint64_t rounds = hil::tests::rounds(20'000, 1'000'000);
  for (std::uint64_t seed = 0; seed < rounds; ++seed) {
    tests::TextMutator mutator(seed);
    const std::string text = "c: >-\n  " + mutator.mutate(originals[seed % originals.size()]) + "\n";
    config::Diagnostics diagnostics;
    const auto value = config::parse_text("f.yaml", text, schema, diagnostics);
    if (!value) continue;
    const auto expression = config::Expression::parse((*value)["c"], diagnostics);
    if (!expression) {
      ASSERT_EQ(diagnostics.count(), 1U) << text;
      continue;
    }
    for (const bool truth : {true, false}) {
      config::Diagnostics mistakes;
      auto program = Program::compile(*expression, names, {.truth = truth},
                                      {.period_ns = test::period_ns, .seed = seed}, mistakes);
      ASSERT_EQ(program.has_value(), mistakes.empty()) << text << mistakes.to_text();
      for (const config::Mistake& mistake : mistakes.mistakes())
        ASSERT_GE(mistake.place.line, 1U) << text;
      if (!program) continue;
      ++compiled;
      for (int step = 0; step < 3; ++step) {
        const double result = program->evaluate(names.values(), 0.1 * step);
        ASSERT_TRUE(std::isnan(result) || std::isfinite(result)) << text;
        ASSERT_TRUE(!truth || std::isnan(result) || result == 0.0 || result == 1.0) << text << result;
      }
    }
  }
  EXPECT_GT(compiled, rounds / 40);
}

}  // namespace
}  // namespace hil::expression
