// Mistakes that a newcomer makes: `hil check` reports each with one sentence, at its place.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// A right scenario of 35 lines. Each mistake replaces one text in it.
const std::string right = R"(scenario: tank
base_rate: 1 kHz
duration: 10 s
clock: virtual
variables:
  full: tank.level > 1.2 m
world:
  layers: [body]
  entities:
    - {name: crane, shape: {box: [1 m, 1 m, 1 m]}, mask: [body]}
    - {name: cart, shape: {box: [1 m, 1 m, 1 m]}, position: [9 m, 0 m, 0 m], mask: [body]}
tasks:
  - module: tank
    type: block
    rate: 1 kHz
    parameters:
      parameters: {area: 0.5 m2}
      inputs: {inflow: l/s}
      tables: {pump: {x: {points: [0, 1, 2]}, values: [0, 2, 3]}}
      states: {level: {initial: 1 m, derivative: inflow / area, min: 0, max: 2 m}}
      variables: {power: pump(inflow / (1 l/s))}
  - module: plc
    type: block
    rate: 100 Hz
    inputs: {level: tank.level}
    parameters: {inputs: {level: m}, outputs: {trip: level > 1.2 m}}
can:
  - {bus: car, database: ecu.dbc, rate: 1 kHz, receive: [{message: Limiter, timeout: 1 s}]}
stimuli:
  - {name: filling, drives: tank.inflow, sequence: [{ramp: 2 l/s, for: 2 s}, {hold: 1 l/s}]}
faults:
  - {name: stuck, signal: tank.level, stuck: last, at: 3 s, for: 1 s}
  - {name: near, signal: tank.level, offset: 1 cm, while: 'distance(crane, cart) < 5 m'}
expectations:
  - {name: no overflow, never: tank.level > 1.9 m}
)";

class NewcomerMistakes : public testing::Test {
 protected:
  NewcomerMistakes() {
    write_text(folder_ / "ecu.dbc", read_text(std::string(HIL_SOURCE_DIR) + "/configs/ecu/ecu.dbc"));
    write_text(folder_ / "gap.csv", "time,inflow\n0,1\n1,\n2,1\n");
    write_text(folder_ / "back.csv", "time,inflow\n0,1\n2,1\n1,1\n");
  }
  Ended check(const std::string& wrong, const std::string& by) {
    std::string text = right;
    const std::size_t at = text.find(wrong);
    EXPECT_NE(at, std::string::npos) << wrong;
    text.replace(at, wrong.size(), by);
    write_text(folder_ / "s.yaml", text);
    return run_hil({"check", folder_ / "s.yaml"});
  }
  Folder folder_;
};

TEST_F(NewcomerMistakes, NoneIsRight) {
  write_text(folder_ / "s.yaml", right);
  const Ended ended = run_hil({"check", folder_ / "s.yaml"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
}

TEST_F(NewcomerMistakes, EachIsOneSentenceWithItsPlace) {
  const struct {
    std::string wrong, by, mistake;
  } all[] = {
      {"never: tank.level > 1.9 m", "never: tank.level > 1.9 s", "s.yaml:35:43: '>' has operands in m and s"},
      {"never: tank.level > 1.9 m", "never: tank.levl > 1.9 m",
       "s.yaml:35:32: there is no signal 'tank.levl'; did you mean 'tank.level'?"},
      {"never: tank.level > 1.9 m", "never: tank.level >> 1.9 m",
       "s.yaml:35:44: expected a signal or a number, found '>'"},
      {"never: tank.level > 1.9 m", "never: tank.level",
       "s.yaml:35:32: the condition has to be true or false; this is a value in m"},
      {"never: tank.level > 1.9 m", "sometimes: tank.level > 1.9 m",
       "s.yaml:35:25: unknown key 'sometimes'; known here: never, always, eventually, response, reaction, "
       "count, order, cycle_time, tracks, statistics, fresh, name, by, between, after, until, coverage"},
      {"signal: tank.level, stuck", "signal: plc.trip, stuck",
       "s.yaml:32:27: no module and no bus reads 'plc.trip', so a fault of it has no effect"},
      {"stuck: last, at: 3 s", "stuck: last, at: 30 s",
       "s.yaml:32:56: 'at': 30 s is not before the end of the run, which takes 10 s; give an earlier time or "
       "a "
       "longer duration"},
      {"stuck: last, at: 3 s", "stuck: last, when: tank.level, at: 3 s",
       "s.yaml:32:58: 'when' and 'at' exclude each other: both say when it begins"},
      {"stuck: last, at: 3 s, for: 1 s", "drop: 10 %, at: 3 s, for: 1 s",
       "s.yaml:32:45: a signal has no fault 'drop'; it has stuck, offset, gain, noise, drift, delay and "
       "dropout"},
      {"points: [0, 1, 2]", "points: [0, 2, 1]",
       "s.yaml:19:42: the points of a table have to be strictly increasing, but 1 is not above the point "
       "before it"},
      {"crane, cart)", "crane, car)", "s.yaml:33:76: there is no body 'car'; did you mean 'cart'?"},
      {"distance(crane, cart) < 5 m", "inside(cart, gate)",
       "s.yaml:33:73: there is no region 'gate' in world.regions"},
      {"{ramp: 2 l/s, for: 2 s}", "{ramp: 2 l/s}", "s.yaml:30:53: a ramp needs its duration 'for'"},
      {"{ramp: 2 l/s, for: 2 s}", "{ramp: 2 m, for: 2 s}",
       "s.yaml:30:60: 'tank.inflow' is in l/s; this is in m"},
      {"sequence: [{ramp: 2 l/s, for: 2 s}, {hold: 1 l/s}]}", "file: {path: gap.csv, column: inflow}}",
       "gap.csv:3:3: an empty cell: a number is missing"},
      {"sequence: [{ramp: 2 l/s, for: 2 s}, {hold: 1 l/s}]}", "file: {path: back.csv, column: inflow}}",
       "back.csv:4:1: times have to be strictly increasing, but this one is not after that of the row "
       "before"},
      {"sequence: [{ramp: 2 l/s, for: 2 s}, {hold: 1 l/s}]}", "file: {path: none.csv, column: inflow}}",
       "s.yaml:30:55: 'path': 'none.csv': there is no such file (none.csv)"},
      {"stimuli:\n", "stimuli:\n  - {name: again, drives: tank.inflow, sequence: [{hold: 1 l/s}]}\n",
       "s.yaml:31:29: 'tank.inflow' is driven by stimulus again already"},
      {"derivative: inflow / area", "derivative: inflow",
       "s.yaml:20:50: the derivative of 'level' is in m/s; this is in l/s"},
      {"derivative: inflow / area", "derivative: inflow / aera",
       "s.yaml:20:59: there is no input, parameter, state or variable 'aera'; did you mean 'area'?"},
      {"rate: 100 Hz\n    inputs", "rate: 300 Hz\n    inputs",
       "s.yaml:24:11: 'rate': 300 Hz does not divide the base rate; the nearest that do are 333.333333333 Hz "
       "(1 kHz / 3) and 250 Hz (1 kHz / 4)"},
      {"message: Limiter", "message: Limitr",
       "s.yaml:28:68: the CAN database has no message 'Limitr'; did you mean 'Limiter'?"},
      {"bus: car, database", "bus: car, rat: 1, database",
       "s.yaml:28:16: unknown key 'rat'; did you mean 'rate'?"},
  };
  for (const auto& [wrong, by, mistake] : all) {
    const Ended ended = check(wrong, by);
    EXPECT_EQ(ended.code, 2) << by;
    std::string errors = ended.errors;
    for (std::size_t at; (at = errors.find(folder_ / "")) != std::string::npos;)
      errors.erase(at, (folder_ / "").size());
    EXPECT_EQ(errors, mistake + "\n") << by;
  }
}

}  // namespace
}  // namespace hil::scenario_test
