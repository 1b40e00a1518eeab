// Variables of scenarios as signals.

#include <cmath>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::run {
namespace {

class Variables : public test::WiringFixture {
 protected:
  /// A scenario with the block "b" and these variables.
  std::optional<Wiring> with(const std::string& variables, const std::string& more = "") {
    return wired(
        "scenario: s\nbase_rate: 1 kHz\nduration: 1 s\nvariables: {" + variables +
        "}\ntasks:\n"
        "  - module: b\n    type: block\n    rate: 1 kHz\n    inputs: {gain: k}\n"
        "    parameters: {inputs: {gain: '1'}, states: {x: {initial: 2 m, derivative: gain * 1 m/s}}}\n" +
        more);
  }
  double value(const Wiring& wiring, const std::string& name) {
    return wiring.signals.value(*wiring.signals.find(name));
  }
  std::string mistakes() const {
    const std::string text = diagnostics_.to_text();
    const std::size_t at = text.find("scenario.yaml");
    return at == std::string::npos ? text : text.substr(at);
  }
};

TEST_F(Variables, AreSignalsWithTheirUnits) {
  auto wiring = with("k: 3, twice: 2 * far, far: {value: b.x, unit: km}, late: b.x > 2.5 m");
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(value(*wiring, "k"), 3.0) << "before the first tick";
  EXPECT_EQ(value(*wiring, "far"), 0.002);
  EXPECT_EQ(wiring->signals.info(*wiring->signals.find("far")).unit, "km");
  EXPECT_EQ(wiring->signals.info(*wiring->signals.find("twice")).unit, "km");
  wiring->signals.write(*wiring->signals.find("b.x"), 3.0, 5);
  wiring->variables.update(wiring->signals, 5);
  EXPECT_EQ(value(*wiring, "far"), 0.003);
  EXPECT_EQ(value(*wiring, "twice"), 0.006) << "of the same tick, whatever the order in the file";
  EXPECT_EQ(value(*wiring, "late"), 1.0);
  EXPECT_EQ(wiring->signals.read(*wiring->signals.find("late")).time_ns, 5);
}

TEST_F(Variables, OfUnknownSignalsAreUnknown) {
  auto wiring = with("k: 3, inverse: 1 m / b.x, limited: if b.x == b.x then 1 else 2");
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  wiring->signals.write(*wiring->signals.find("b.x"), std::nan(""), 0);
  wiring->variables.update(wiring->signals, 0);
  EXPECT_TRUE(std::isnan(value(*wiring, "inverse")));
  EXPECT_TRUE(std::isnan(value(*wiring, "limited")));
  EXPECT_EQ(value(*wiring, "k"), 3.0);
}

TEST_F(Variables, WithAMemoryAdvanceOnceATick) {
  auto wiring = with("k: 3, ticks: 'count(mod(time, 2 ms) < 1 ms)'");
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (std::int64_t tick = 0; tick < 10; ++tick)
    wiring->variables.update(wiring->signals, tick * 1'000'000);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_EQ(value(*wiring, "ticks"), 5.0) << "it becomes true at 0, 2, 4 ... ms";
}

TEST_F(Variables, ReportTheirMistakes) {
  const struct {
    std::string variables, mistake;
  } all[] = {
      {"k: 1, v: b.y", "scenario.yaml:4:22: there is no signal 'b.y'; did you mean 'b.x'?"},
      {"k: 1, v: 1 m + 1 s", "scenario.yaml:4:26: '+' has operands in m and s"},
      {"k: 1, v: w, w: v", "scenario.yaml:4:19: v needs w needs v: a value can not be computed from itself"},
      {"k: 1, v: {value: 1 m, unit: s}", "scenario.yaml:4:30: 'v' is in s; this is in m"},
      {"k: 1, v: {value: 1, unit: metre}", "scenario.yaml:4:39: 'metre' is not a known unit"},
      {"k: 1, time: 3", "scenario.yaml:4:19: 'time' is a word of the expression language"},
      {"k: 1, v: 1 +", "scenario.yaml:4:25: the expression ends where"},
  };
  for (const auto& one : all) {
    EXPECT_FALSE(with(one.variables));
    EXPECT_EQ(mistakes().find(one.mistake), 0U) << one.variables << "\n" << mistakes();
    EXPECT_EQ(diagnostics_.count(), 1U) << mistakes();
  }
}

TEST_F(Variables, WithAMistakeAddNoneWhereTheyAreRead) {
  EXPECT_FALSE(
      with("k: 1 m + 1 s, v: k + 1 m", "expectations: [{name: e, always: v > k and b.x > b.foo}]\n"));
  EXPECT_EQ(diagnostics_.count(), 2U) << mistakes();
  EXPECT_NE(mistakes().find("there is no signal 'b.foo'"), std::string::npos) << mistakes();
}

TEST_F(Variables, ScenarioWithoutSignalsReportsUnknownNames) {
  EXPECT_FALSE(wired("scenario: s\nexpectations: [{name: e, always: foo > 1}]\n"));
  EXPECT_NE(mistakes().find("there is no signal 'foo'"), std::string::npos) << mistakes();
}

}  // namespace
}  // namespace hil::run
