// Blocks: integration against exact solutions, the order within a step, state machines, unknown values.

#include <cmath>
#include <numbers>

#include "block_run.hpp"
#include "tests/support/allocation_guard.hpp"

namespace hil::modules {
namespace {

using test::BlockRun;
using test::ms;

constexpr const char* decay = "states: {x: {initial: 1, derivative: -x / 0.5 s}}\n";

TEST(BlockIntegration, RungeKuttaFollowsADecay) {
  BlockRun run(decay);
  run.step();
  EXPECT_EQ(run["x"], 1.0) << "the first step has the initial value";
  run.run_to(1'000 * ms);
  EXPECT_NEAR(run["x"], std::exp(-2.0), 1e-9);
}

TEST(BlockIntegration, EulerIsTheProductOfItsSteps) {
  BlockRun run(std::string(decay) + "integrator: euler\n");
  run.run_to(1'000 * ms);
  EXPECT_NEAR(run["x"], std::pow(1.0 - 0.02, 100), 1e-14);
}

/// The error of an oscillator with a period of 1 s after 10 s.
double oscillator_error(std::int64_t period_ns) {
  BlockRun run(
      "states: {x: {initial: 1 m, derivative: v}, v: {initial: 0 m/s, derivative: -w ^ 2 * x}}\n"
      "parameters: {w: 6.283185307179586 rad/s}\n",
      {.instance = "b", .period_ns = period_ns});
  run.run_to(10'000 * ms);
  return std::hypot(run["x"] - 1.0, run["v"] / (2.0 * std::numbers::pi));
}

TEST(BlockIntegration, RungeKuttaHasOrderFour) {
  const double coarse = oscillator_error(20 * ms), fine = oscillator_error(10 * ms);
  EXPECT_NEAR(coarse / fine, 16.0, 2.0);
}

TEST(BlockIntegration, TimeOfTheStagesIsThatBetweenTheSteps) {
  // Runge and Kutta's method is exact for a cubic.
  BlockRun run("states: {x: {initial: 0 m, derivative: 3 m/s^3 * time ^ 2}}\n");
  run.run_to(2'000 * ms);
  EXPECT_NEAR(run["x"], 8.0, 1e-12);
}

TEST(BlockIntegration, VariablesAreThoseOfTheStages) {
  const char* const states = "states: {x: {initial: 1, derivative: rate}}\n";
  BlockRun direct("states: {x: {initial: 1, derivative: -x ^ 2 / 1 s}}\n");
  BlockRun by_variable(std::string(states) + "variables: {rate: -square / 1 s, square: x ^ 2}\n");
  direct.run_to(500 * ms);
  by_variable.run_to(500 * ms);
  EXPECT_EQ(direct["x"], by_variable["x"]);
  EXPECT_NEAR(direct["x"], 1.0 / 1.5, 1e-9);
}

TEST(BlockIntegration, FunctionsWithAMemoryAdvanceOnceAStep) {
  // A count that each stage advanced would be four times as high.
  BlockRun run(
      "states: {x: {initial: 0, derivative: count(n - 2 * floor(n / 2) == 1) / 1 s}, n: {next: n + 1}}\n");
  run.run_to(90 * ms);
  // n is 0 1 2 ...; the count is 0 1 1 2 2 3 3 4 4 in the nine steps before 90 ms, each held for 10 ms.
  EXPECT_NEAR(run["x"], 0.01 * (0 + 1 + 1 + 2 + 2 + 3 + 3 + 4 + 4), 1e-12);
}

TEST(BlockUnits, OfTheDerivativeAreConverted) {
  BlockRun run(
      "states:\n"
      "  v: {unit: km/h, initial: 0, derivative: 1 m/s2}\n"
      "  t: {unit: degC, initial: 20, derivative: 6 K/min}\n"
      "  f: {unit: degF, initial: 32, derivative: 1 K/s}\n"
      "  n: {unit: rpm, initial: 60, derivative: 60 rpm/s}\n"
      "  w: {unit: km/h, initial: 0, derivative: 3.6}\n"
      "variables: {kelvin: {value: t, unit: K}, sum: t + 1 K}\n");
  run.run_to(10'000 * ms);
  EXPECT_NEAR(run["v"], 36.0, 1e-9);
  EXPECT_NEAR(run["t"], 21.0, 1e-9);
  EXPECT_NEAR(run["f"], 32.0 + 18.0, 1e-9);
  EXPECT_NEAR(run["n"], 660.0, 1e-9);
  EXPECT_NEAR(run["w"], 36.0, 1e-9) << "a plain number is in the state's unit per second";
  EXPECT_NEAR(run["kelvin"], 294.15, 1e-9);
  EXPECT_EQ(run.ports().outputs[0].unit, "km/h");
  EXPECT_EQ(run.ports().outputs[5].unit, "K");
}

TEST(BlockUnits, OfVariablesAreThoseOfTheirExpressions) {
  BlockRun run(
      "inputs: {v: {unit: km/h, initial: 36}, n: {unit: '1', initial: 3}}\n"
      "variables: {a: v * 2, b: v * 1 s, c: n + 1, d: v > 30, e: v / (10 m/s)}\n");
  run.step();
  EXPECT_EQ(run["a"], 72.0);
  EXPECT_EQ(run["b"], 10.0);
  EXPECT_EQ(run["c"], 4.0);
  EXPECT_EQ(run["d"], 1.0);
  EXPECT_EQ(run["e"], 1.0);
  const std::vector<std::string> units{"km/h", "m", "", "", ""};
  for (std::size_t i = 0; i < units.size(); ++i)
    EXPECT_EQ(run.ports().outputs[i].unit, units[i]) << run.ports().outputs[i].name;
}

TEST(BlockStates, StayWithinTheirLimitsAndLeaveThemAtOnce) {
  BlockRun run(
      "inputs: {flow: {unit: m/s, initial: 1}}\n"
      "states: {x: {initial: 0.5 m, derivative: flow, min: 0, max: top}}\n"
      "parameters: {top: 1 m}\n");
  run.run_to(1'000 * ms);
  EXPECT_EQ(run["x"], 1.0);
  run.set("flow", -1.0);
  run.run_to(1'020 * ms);
  EXPECT_NEAR(run["x"], 0.99, 1e-12);
  run.run_to(3'000 * ms);
  EXPECT_EQ(run["x"], 0.0);
}

TEST(BlockStates, AreSetByTheirReset) {
  BlockRun run(
      "states:\n"
      "  x: {initial: 0 m, derivative: 1 m/s, reset: {when: x >= 0.1 m, to: x - 0.1 m}}\n"
      "variables: {twice: 2 * x}\n");
  run.run_to(90 * ms);
  EXPECT_NEAR(run["x"], 0.09, 1e-12);
  run.run_to(110 * ms);  // rounding may reach 0.1 m one step later
  EXPECT_LT(run["x"], 0.011);
  EXPECT_EQ(run["twice"], 2.0 * run["x"]) << "variables follow the reset in its step";
}

TEST(BlockStates, NextIsOfTheStepAfter) {
  BlockRun run(
      "inputs: {u: {unit: '1', initial: 5}}\n"
      "states: {last: {initial: 0, next: u}, before: {initial: 0, next: last}, kept: {initial: 4}}\n");
  run.step();
  EXPECT_EQ(run["last"], 0.0);
  run.step();
  EXPECT_EQ(run["last"], 5.0);
  EXPECT_EQ(run["before"], 0.0) << "all next values are of one step";
  run.step();
  EXPECT_EQ(run["before"], 5.0);
  EXPECT_EQ(run["kept"], 4.0);
}

TEST(BlockStates, OfASkippedReleaseAreComputedWithTheInputsBeforeIt) {
  const std::string yaml =
      "inputs: {u: {unit: '1', initial: 0}}\n"
      "states: {x: {initial: 0, derivative: u / 1 s}, n: {next: n + count(u > 0)}}\n"
      "state_machines: {m: {states: {a: {transitions: [{to: b, after: 50 ms}]}, b: {}}}}\n";
  BlockRun all(yaml), some(yaml);
  for (BlockRun* run : {&all, &some}) {
    run->set("u", 2.0);
    run->run_to(20 * ms);
  }
  all.run_to(70 * ms);
  all.set("u", 9.0);
  all.step();
  some.set("u", 9.0);
  some.step_at(80 * ms);  // 30 to 70 ms were skipped
  for (const char* name : {"x", "n", "m"})
    EXPECT_EQ(all[name], some[name]) << name;
  EXPECT_EQ(all.events(), some.events());
  EXPECT_NEAR(all["x"], 0.16, 1e-12);
}

TEST(BlockStates, FirstStepIsAtTheOffset) {
  BlockRun run(decay, {.instance = "b", .period_ns = 10 * ms, .offset_ns = 4 * ms});
  run.step_at(4 * ms);
  EXPECT_EQ(run["x"], 1.0);
  run.step_at(14 * ms);
  EXPECT_NEAR(run["x"], std::exp(-0.02), 1e-9);
}

constexpr const char* machine = R"(
inputs: {start: {unit: '1', initial: 0}}
states: {lamp: {initial: 0}, runs: {initial: 0}}
state_machines:
  m:
    states:
      off: {entry: {lamp: 0}, transitions: [{to: on, when: rise(start)}]}
      on:
        entry: {lamp: 1, runs: runs + 1}
        transitions:
          - {to: failed, when: runs > 2}
          - {to: off, after: 30 ms}
      failed: {entry: {lamp: 0.5 + time / 1 s}}
outputs: {m: m, lamp: lamp, runs: runs, time: {value: m.time, unit: ms}, is_on: m == on}
)";

TEST(BlockMachines, ChangeStateAtExactInstants) {
  BlockRun run(machine);
  run.step();
  EXPECT_EQ(run["m"], 0.0);
  run.set("start", 1.0);
  run.step();  // at 10 ms
  EXPECT_EQ(run["m"], 1.0);
  EXPECT_EQ(run["lamp"], 1.0) << "an entry action acts in the step of its transition";
  EXPECT_EQ(run["is_on"], 1.0);
  EXPECT_EQ(run["time"], 0.0);
  run.run_to(30 * ms);
  EXPECT_EQ(run["m"], 1.0);
  EXPECT_EQ(run["time"], 20.0);
  run.step();
  EXPECT_EQ(run["m"], 0.0) << "30 ms after it was entered";
  run.run_to(100 * ms);
  EXPECT_EQ(run["m"], 0.0) << "rise() begins anew when its state is entered: start has not risen since";
  for (int i = 0; i < 2; ++i) {
    run.set("start", 0.0);
    run.step();
    run.set("start", 1.0);
    run.run_to(160 * ms + i * 60 * ms);
  }
  EXPECT_EQ(run["runs"], 3.0);
  EXPECT_EQ(run["m"], 2.0);
  EXPECT_NEAR(run["lamp"], 0.5 + 0.190, 1e-12) << "an entry action is computed once, when it is entered";
  const std::vector<std::string> events{"0 ms: b.m is off",     "10 ms: b.m is on",   "40 ms: b.m is off",
                                        "120 ms: b.m is on",    "150 ms: b.m is off", "180 ms: b.m is on",
                                        "190 ms: b.m is failed"};
  EXPECT_EQ(run.events(), events);
}

TEST(BlockMachines, StatesAreNamesOfValues) {
  BlockRun run(machine);
  EXPECT_EQ(run.ports().outputs[0].named_values,
            (std::map<std::string, double>{{"off", 0.0}, {"on", 1.0}, {"failed", 2.0}}));
}

TEST(BlockMachines, BeginInTheirInitialState) {
  BlockRun run(
      "state_machines: {m: {initial: b, events: false, states: {a: {}, b: {entry: {x: 3}}}}}\n"
      "states: {x: {initial: 1}}\n");
  EXPECT_EQ(run.ports().outputs[0].initial, 3.0) << "what other modules read before the first step";
  run.step();
  EXPECT_EQ(run["m"], 1.0);
  EXPECT_EQ(run["x"], 3.0);
  EXPECT_TRUE(run.events().empty());
}

TEST(BlockInputs, AreValuesWithNamesAndFreshness) {
  BlockRun run(
      "inputs: {gear: {unit: '1', initial: 0, values: {park: 0, drive: 4}}}\n"
      "outputs: {drives: gear == drive, gear: gear, fresh: gear.fresh}\n");
  run.step();
  EXPECT_EQ(run["drives"], 0.0);
  EXPECT_EQ(run["fresh"], 0.0);
  run.set("gear", 4.0);
  run.step();
  EXPECT_EQ(run["drives"], 1.0);
  EXPECT_EQ(run["fresh"], 1.0);
  EXPECT_EQ(run.ports().outputs[1].named_values.at("drive"), 4.0);
}

TEST(BlockInputs, WithoutAnInitialValueHaveToBeConnected) {
  BlockRun run(
      "inputs: {a: m, b: {unit: m, initial: half}}\nparameters: {half: 0.5 * full, full: 3 km}\n"
      "outputs: {a: a}\n");
  EXPECT_TRUE(run.ports().inputs[0].required);
  EXPECT_FALSE(run.ports().inputs[1].required);
  EXPECT_EQ(run.ports().inputs[1].initial, 1500.0);
}

TEST(BlockParameters, CanBeDriven) {
  BlockRun run(
      "parameters: {gain: 2, twice: 2 * gain}\ninputs: {u: {unit: '1', initial: 3}}\n"
      "outputs: {y: gain * u, twice: twice, fresh: u.fresh}\n");
  EXPECT_EQ(run.ports().inputs[1].name, "gain");
  EXPECT_EQ(run.ports().inputs[1].initial, 2.0);
  EXPECT_FALSE(run.ports().inputs[1].required);
  run.step();
  EXPECT_EQ(run["y"], 6.0);
  run.set("gain", 5.0);
  run.step();
  EXPECT_EQ(run["y"], 15.0);
  EXPECT_EQ(run["twice"], 4.0) << "a parameter that is computed from others keeps its value";
  EXPECT_EQ(run["fresh"], 0.0);
}

TEST(BlockUnknown, ValuesAreNotKnownUntilTheyAreSet) {
  BlockRun run(
      "inputs: {u: {unit: '1', initial: 1}, set: {unit: '1', initial: 0}}\n"
      "states: {x: {initial: 0, derivative: 1 / u / 1 s, max: 10, reset: {when: set, to: 7}}, y: {next: y}}\n"
      "variables: {inverse: 1 / u}\n");
  run.run_to(20 * ms);
  EXPECT_NEAR(run["x"], 0.02, 1e-12);
  run.set("u", 0.0);
  run.step();
  EXPECT_TRUE(std::isnan(run["inverse"]));
  EXPECT_NEAR(run["x"], 0.03, 1e-12) << "the state at this instant is known";
  run.set("u", 1.0);
  run.run_to(60 * ms);
  EXPECT_TRUE(std::isnan(run["x"]));
  EXPECT_EQ(run["y"], 0.0);
  run.set("set", 1.0);
  run.step();
  EXPECT_EQ(run["x"], 7.0);
  EXPECT_EQ(run.events(),
            std::vector<std::string>{"30 ms: b.x is unknown from here on: its equations have no "
                                     "finite value"});
}

TEST(BlockUnknown, ValueBeyondTheNumbersIsNotKnown) {
  BlockRun run("states: {x: {initial: 1, derivative: 1e3 * x ^ 3 / 1 s}}\nintegrator: euler\n");
  run.run_to(1'000 * ms);
  EXPECT_TRUE(std::isnan(run["x"]));
}

TEST(BlockTables, AreCalledLikeFunctions) {
  BlockRun run(R"yaml(
inputs: {v: {unit: km/h, initial: 0}, pedal: {unit: '%', initial: 50}}
tables:
  drag: {x: {unit: m/s, points: [0, 10, 20]}, values: [0, 1, 4], unit: kN}
  map: {x: {unit: km/h, points: [0, 100]}, y: {unit: '%', points: [0, 100]}, rows: [[0, 0], [200, 100]]}
outputs: {drag: drag(v), torque: "map(v, pedal)", next: "drag(15)"}
)yaml");
  run.set("v", 54.0);
  run.step();
  EXPECT_NEAR(run["drag"], 2.5, 1e-12);
  EXPECT_NEAR(run["torque"], 73.0, 1e-12);
  EXPECT_NEAR(run["next"], 2.5, 1e-12) << "a plain number is in the unit of the points";
  EXPECT_EQ(run.ports().outputs[0].unit, "kN");
}

TEST(BlockNoise, IsOfTheRunTheModuleAndTheExpression) {
  const std::string yaml = "variables: {a: noise(1), b: noise(1)}\n";
  BlockRun first(yaml), again(yaml), other(yaml, {.instance = "c", .period_ns = 10 * ms, .seed = 7}),
      seeded(yaml, {.instance = "b", .period_ns = 10 * ms, .seed = 8});
  for (BlockRun* run : {&first, &again, &other, &seeded})
    run->run_to(50 * ms);
  EXPECT_EQ(first["a"], again["a"]);
  EXPECT_NE(first["a"], first["b"]);
  EXPECT_NE(first["a"], other["a"]);
  EXPECT_NE(first["a"], seeded["a"]);
}

TEST(BlockStep, NeitherAllocatesNorFrees) {
  BlockRun run(std::string(machine) +
               "tables: {t: {x: {points: [0, 1]}, values: [0, 1]}}\n"
               "variables: {late: 'delay(t(start), 50 ms)', n: noise(1)}\n");
  run.set("start", 1.0);
  run.step();
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int i = 0; i < 50; ++i)
    run.step();
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

TEST(Block, KnowsTheNamesOfValuesOfTheSignalsThatItReads) {
  TaskParameters task = test::ten_ms();
  task.value_names["gear"] = {{{"Park", 3.0}, {"Drive", 4.0}}, ""};
  task.value_names["speed"] = {{{"walk", 3.6}, {"limp home", 36.0}}, "km/h"};
  task.value_names["own"] = {{{"Park", 9.0}}, ""};
  const std::string yaml =
      "inputs: {gear: '1', speed: m/s, own: {unit: '1', values: {Park: 1}}}\n"
      "variables: {in_park: gear == Park, limps: speed >= 'limp home', walks: speed == walk, same: own == "
      "Park}\n"
      "outputs: {gear: gear, speed: speed, in_park: in_park, limps: limps, walks: walks, same: same}\n";
  test::BlockRun run(yaml, task);
  run.set("gear", 3.0);
  run.set("speed", 10.0);
  run.set("own", 1.0);
  run.step();
  EXPECT_EQ(run["in_park"], 1.0);
  EXPECT_EQ(run["limps"], 1.0);
  EXPECT_EQ(run["same"], 1.0) << "names of the input come first";
  run.set("speed", 1.0);
  run.step();
  EXPECT_EQ(run["walks"], 1.0) << "converted for the input";
  EXPECT_EQ(run["limps"], 0.0);
  EXPECT_EQ(run.ports().outputs[0].named_values.at("Drive"), 4.0);
  EXPECT_DOUBLE_EQ(run.ports().outputs[1].named_values.at("limp home"), 10.0);
}

TEST(Block, AcceptsAnyNameOfASignalWhosePartHasAMistake) {
  TaskParameters task = test::ten_ms();
  const std::string yaml = "inputs: {gear: '1'}\noutputs: {y: gear == Park or gear == 'limp home'}\n";
  config::Diagnostics none, one;
  EXPECT_EQ(test::create_block(yaml, one, task), nullptr);
  EXPECT_NE(one.to_text().find("'Park' is no number"), std::string::npos) << one.to_text();
  task.value_names["gear"] = {.accepts_any_name = true};
  EXPECT_NE(test::create_block(yaml, none, task), nullptr);
}

}  // namespace
}  // namespace hil::modules
