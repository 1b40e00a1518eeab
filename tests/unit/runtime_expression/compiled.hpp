#pragma once
// Compiled expressions over a few variables.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/config/parse.hpp"
#include "runtime/expression/program.hpp"

namespace hil::expression::test {

inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// a = 1, b = 2, lost = unknown; v = 10 m/s, kmh = 36 km/h, t = 20 degC, x = 3 m, dt = 0.5 s, raw = 7 steps;
/// state = 2 with value names; share = 50 %, angle = 90 deg, u = 50 degF, k = 300 K, n = 600 rpm,
/// w = 2 rad/s, f = 10 Hz; rise = 8 K is a difference, rate = 4 1/s computed from other units;
/// raw_share = 0.2 comes from a device and has no unit; cycles = 3 is a number of cycles.
class Names final : public Scope {
 public:
  std::optional<Variable> find(std::string_view name) const override {
    for (std::uint32_t i = 0; i < all.size(); ++i)
      if (all[i].name == name)
        return Variable{.index = i,
                        .unit = all[i].unit,
                        .named_values = name == "state" ? &states : nullptr,
                        .value_kind = all[i].value_kind,
                        .lacks_unit = name == "raw_share"};
    return std::nullopt;
  }
  bool is_broken(std::string_view name) const override { return name.starts_with("broken."); }
  std::vector<std::string> names() const override {
    std::vector<std::string> result;
    for (const Named& named : all)
      result.push_back(named.name);
    return result;
  }
  std::vector<double> values() const {
    std::vector<double> result;
    for (const Named& named : all)
      result.push_back(named.value);
    return result;
  }

  struct Named {
    std::string name, unit;
    double value = 0.0;
    units::ValueKind value_kind = units::ValueKind::as_unit;
  };
  std::vector<Named> all{{"a", "", 1.0},
                         {"b", "", 2.0},
                         {"lost", "", unknown},
                         {"v", "m/s", 10.0},
                         {"kmh", "km/h", 36.0},
                         {"t", "degC", 20.0},
                         {"x", "m", 3.0},
                         {"dt", "s", 0.5},
                         {"raw", "steps", 7.0},
                         {"state", "", 2.0},
                         {"share", "%", 50.0},
                         {"angle", "deg", 90.0},
                         {"u", "degF", 50.0},
                         {"k", "K", 300.0},
                         {"n", "rpm", 600.0},
                         {"w", "rad/s", 2.0},
                         {"f", "Hz", 10.0},
                         {"rise", "K", 8.0, units::ValueKind::difference},
                         {"rate", "1/s", 4.0, units::ValueKind::open},
                         {"raw_share", "", 0.2},
                         {"cycles", "", 3.0, units::ValueKind::open}};
  std::map<std::string, double> states{{"green", 1.0}, {"red", 2.0}, {"same", unknown}};
};

inline constexpr std::int64_t period_ns = 100'000'000;

/// Empty: `mistakes` has them.
inline std::optional<Program> compile(const std::string& written, const ResultSpec& spec,
                                      std::string* mistakes = nullptr) {
  config::Diagnostics diagnostics;
  const auto value = config::parse_text("f", '"' + written + '"', config::Schema::text(), diagnostics);
  if (!value) throw std::runtime_error(diagnostics.to_text());
  const auto expression = config::Expression::parse(*value, diagnostics);
  if (!expression) throw std::runtime_error(diagnostics.to_text());
  auto program =
      Program::compile(*expression, Names(), spec, {.period_ns = period_ns, .seed = 5}, diagnostics);
  EXPECT_EQ(program.has_value(), diagnostics.count() == 0 && !written.starts_with("broken."));
  if (mistakes != nullptr) *mistakes = diagnostics.to_text();
  if (mistakes == nullptr && !program) throw std::runtime_error(written + ": " + diagnostics.to_text());
  return program;
}

inline double value_of(const std::string& written, const std::string& unit = "") {
  return compile(written, {.unit = unit})->evaluate(Names().values(), 1.5);
}
/// 1, 0 or NaN.
inline double truth_of(const std::string& written) {
  return compile(written, {.truth = true})->evaluate(Names().values(), 1.5);
}

}  // namespace hil::expression::test
