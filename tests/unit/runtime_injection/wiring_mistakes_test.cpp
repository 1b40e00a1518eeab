// Mistakes in stimuli and faults: each gives one sentence at its place.

#include <algorithm>

#include "injection_fixture.hpp"

namespace hil::injection {
namespace {

class InjectionMistakes : public test::InjectionFixture {
 protected:
  std::string mistakes_of(const std::string& sections) {
    try {
      open(sections);
      return "";
    } catch (const std::runtime_error& error) {
      const std::string text = error.what();
      const std::size_t at = text.find("scenario.yaml:");
      return at == std::string::npos ? text : text.substr(at + 14);
    }
  }
};

TEST_F(InjectionMistakes, AreReportedWithTheirPlaces) {
  const std::string sequence = "sequence: [{hold: 1 m}]";
  const std::string remedy = "; give an earlier time or a longer duration";
  const struct {
    std::string sections, mistake;
  } all[] = {
      {"stimuli: [{name: s, drives: control.v, " + sequence + "}]",
       "13:29: there is no input of a module and no output of a bus 'control.v'; did you mean 'control.x'?"},
      {"stimuli: [{name: s, drives: control.x, " + sequence + "}]",
       "13:29: module control also has an output 'x'; give one of the two another name"},
      {"can: []\nstimuli: [{name: s, drives: control.w, " + sequence + "}]",
       "14:29: 'control.w' has a signal already; a stimulus drives what has none"},
      {"stimuli:\n  - {name: s, drives: control.u, " + sequence + "}\n  - {name: r, drives: control.u, " +
           sequence + "}",
       "15:23: 'control.u' is driven by stimulus s already"},
      {"stimuli:\n  - {name: s, drives: control.u, " + sequence +
           "}\n  - {name: s, drives: control.t, sequence: [{hold: 1 K}]}",
       "15:12: the stimulus 's' is given twice"},
      {"stimuli: [{name: s, drives: control.u, sequence: [{hold: 1 s}]}]",
       "13:58: 'control.u' is in m; this is in s"},
      {"stimuli: [{name: s, drives: control.u, sequence: [{hold: 1 m}, {hold: 2 m}]}]",
       "13:51: this part needs its duration 'for', since another one follows"},
      {"stimuli: [{name: s, drives: control.u, sequence: [{ramp: 1 m}]}]",
       "13:51: a ramp needs its duration 'for'"},
      {"stimuli: [{name: s, drives: control.u, repeat: 2, " + sequence + "}]",
       "13:62: this part needs its duration 'for', since the sequence repeats"},
      {"stimuli: [{name: s, drives: control.u, at: 500 ms, sequence: [{hold: 1 m, for: 500 ms}, {name: p, "
       "hold: 2 m}]}]",
       "13:89: the part 'p' begins at 1 s, which is not before the end of the run, which takes 1 s"},
      {"stimuli: [{name: s, drives: control.u, at: 1 s, " + sequence + "}]",
       "13:44: 'at': 1 s is not before the end of the run, which takes 1 s" + remedy},
      {"stimuli: [{name: s, drives: control.u, at: 999.5 ms, " + sequence + "}]",
       "13:44: 'at': 999.5 ms is after the last tick of the run, at 999 ms" + remedy},
      {"faults: [{name: f, signal: plant.x, gain: 2, at: 999001 us}]",
       "13:50: 'at': 999.001 ms is after the last tick of the run, at 999 ms" + remedy},
      {"stimuli: [{name: s, drives: plant.x, " + sequence + "}]",
       "13:29: 'plant.x' is written by module plant; a stimulus drives an input of a module or an output of "
       "a bus; known here: control."},
      {"stimuli: [{name: s, drives: control.u, sequence: [{hold: 1 m, for: 1 us}], repeat: 0}]",
       "13:68: 'for': 1 us is shorter than the base period of 1 ms"},
      {"faults: [{name: f, signal: plant.x, gain: 2, at: 1 ms, for: 1 us, every: 2 us}]",
       "13:74: 'every': 2 us is shorter than the base period of 1 ms"},
      {"faults: [{name: f, signal: plant.y, gain: 2}]",
       "13:28: there is no signal 'plant.y'; did you mean 'plant.x'?"},
      {"faults: [{name: f, signal: control.y, gain: 2}]",
       "13:28: no module and no bus reads 'control.y', so a fault of it has no effect"},
      {"faults: [{name: f, signal: plant.x, gain: 2, readers: [contrl]}]",
       "13:56: 'contrl' does not read 'plant.x'; did you mean 'control'?"},
      {"faults: [{name: f, gain: 2}]",
       "13:10: a fault needs its target: 'signal', 'message', 'device', 'process' or 'task'"},
      {"faults: [{name: f, signal: plant.x, task: plant, gain: 2}]",
       "13:43: 'signal' and 'task' exclude each other"},
      {"faults: [{name: f, message: plant.x, gain: 2}]",
       "13:44: a message has no fault 'gain'; it has stuck, drop, repeat, delay, wrong, length and "
       "flip_bits"},
      {"faults: [{name: f, message: can.car.Speed, stuck: 1 m}]",
       "13:51: 'stuck' of a message can only be 'last'"},
      {"faults: [{name: f, message: can.car.Speed, drop: 10 %}]",
       "13:29: 'can.car.Speed' is no message of a bus; it begins with the bus, as in 'can.car.M'"},
      {"faults: [{name: f, device: can.car, state: bus_off}]",
       "13:28: there is no bus and no unit 'can.car'"},
      {"faults: [{name: f, device: can.car, state: paused}]",
       "13:44: a device can not be paused; a process can"},
      {"faults: [{name: f, process: ecu, state: silent}]",
       "13:41: a process can not be silent; it can be paused or killed"},
      {"faults: [{name: f, process: ecu, state: killed, at: 1 ms, for: 1 ms}]",
       "13:41: a killed process does not come back, so its fault has no end"},
      {"faults: [{name: f, process: ecu, state: paused}]", "13:29: there is no process 'ecu'"},
      {"processes: {ecu: {command: [a], enabled: false}}\nfaults: [{name: f, process: ecu, state: paused}]",
       "14:29: the run does not start process 'ecu' (enabled: false), so a fault of it has no effect"},
      {"faults: [{name: f, task: plnt, takes_longer: 2 ms}]",
       "13:26: there is no task of a module 'plnt'; did you mean 'plant'?"},
      {"faults: [{name: f, task: plant, takes_longer: 2 ms, readers: [control]}]",
       "13:62: 'readers' belongs to the fault of a signal"},
      {"faults: [{name: f, signal: plant.x, gain: 2 m}]",
       "13:43: the value of fault 'f' is a plain number; this is in m"},
      {"faults: [{name: f, signal: plant.x, drift: 2 m}]",
       "13:44: the value of fault 'f' is in m/s; this is in m"},
      {"faults: [{name: f, signal: plant.x, stuck: lst}]", "13:44: there is no signal 'lst'"},
      {"faults: [{name: f, signal: plant.x, gain: 100 %}]",
       "13:43: fault 'f' (multiplied by 100 %) does not change 'plant.x'; give another value"},
      {"faults: [{name: f, signal: plant.x, offset: 2 m - 200 cm}]",
       "13:45: fault 'f' (offset by 2 m - 200 cm) does not change 'plant.x'; give another value"},
      {"faults: [{name: f, signal: plant.x, drift: 0 m/s}]",
       "13:44: fault 'f' (drift of 0 m/s) does not change 'plant.x'; give another value"},
      {"faults: [{name: f, signal: plant.x, noise: -1 cm}]",
       "13:44: fault 'f': the standard deviation is -0.01 m; it has to be above 0"},
      {"faults: [{name: f, signal: plant.x, dropout: 0 %}]",
       "13:46: 'dropout': 0 % changes nothing; a fault has a share above 0 %"},
      {"faults: [{name: f, message: can.car.Speed, drop: 0 %}]",
       "13:50: 'drop': 0 % changes nothing; a fault has a share above 0 %"},
      {"faults: [{name: f, message: can.car.Speed, flip_bits: [3, 4, 3]}]",
       "13:62: 'flip_bits': bit 3 is listed twice"},
      {"faults: [{name: f, signal: plant.x, gain: 2, probability: 0 %}]",
       "13:59: 'probability': with 0 % it never begins; give more than 0 %"},
      {"stimuli: [{name: s, drives: control.u, sequence: [{noise: {mean: 1 m, deviation: -20 mm}}]}]",
       "13:82: 'control.u': the standard deviation is -0.02 m; it has to be 0 or above"},
      {"stimuli: [{name: s, drives: control.u, sequence: [{sine: {mean: 1 m, amplitude: 1 m, period: 1.9 "
       "ms}}]}]",
       "13:94: 'period': 1.9 ms is shorter than two base periods of 1 ms, so the ticks do not show the "
       "shape"},
      {"stimuli: [{name: s, drives: control.u, sequence: [{pulses: {low: 1 m, high: 2 m, period: 1 ms}}]}]",
       "13:90: 'period': 1 ms is shorter than two base periods of 1 ms, so the ticks do not show the shape; "
       "give at least 2 ms"},
      {"faults: [{name: f, signal: plant.x, delay: 1.5 ms}]",
       "13:44: 'delay': 1.5 ms is no multiple of the base period of 1 ms"},
      {"faults: [{name: f, signal: plant.x, delay: 2 min}]", "'2 min' is out of range"},
      {"faults: [{name: f, signal: plant.x, gain: 2, offset: 1 m}]", "exactly one of"},
      {"faults: [{name: f, signal: plant.x, gain: 2, at: 1 ms, when: plant.x > 1 m}]",
       "13:62: 'when' and 'at' exclude each other: both say when it begins"},
      {"faults: [{name: f, signal: plant.x, gain: 2, while: plant.x > 1 m, for: 1 ms}]",
       "13:73: 'for' and 'while' exclude each other"},
      {"faults: [{name: f, signal: plant.x, gain: 2, at: 1 ms, every: 2 ms}]",
       "13:63: 'every' needs a shorter 'for'"},
      {"faults: [{name: f, signal: plant.x, gain: 2, at: 1 ms, times: 2}]",
       "13:63: 'times' with 'at' needs 'every'"},
      {"faults: [{name: f, signal: plant.x, gain: 2, when: plant.x > 1}, {name: g, signal: plant.x, gain: 2, "
       "readers: [control]}]",
       "13:73: the faults of 'plant.x' name different readers; all have the same ones"},
      {"faults: [{name: f, signal: plant.x, gain: 2, when: plant.x}]",
       "13:52: 'when' has to be true or false; this is a value in m"},
      {"variables: {v: 1}\nfaults: [{name: f, signal: v, gain: 2}]",
       "14:28: 'v' is a variable; a fault acts on a signal of a module, a bus or a stimulus"},
      {"expectations: [{name: e, always: fault.f == 0}]\nfaults: [{name: f, signal: plant.x, gain: 2 +}]",
       "14:46: the expression ends"},
  };
  for (const auto& one : all) {
    const std::string mistakes = mistakes_of(one.sections + "\n");
    EXPECT_NE(mistakes.find(one.mistake), std::string::npos) << one.sections << "\n" << mistakes;
    EXPECT_EQ(std::ranges::count(mistakes, '\n'), 1) << one.sections << "\n" << mistakes;
  }
}

TEST_F(InjectionMistakes, NamesThatAModuleHasAreRefused) {
  const std::string modules =
      "  - {module: fault, type: block, rate: 1 kHz, parameters: {states: {f: {unit: m}}}}\n"
      "  - {module: stimulus, type: block, rate: 1 kHz, parameters: {states: {s: {unit: m}}}}\n";
  EXPECT_EQ(mistakes_of(modules + "faults: [{name: f, signal: plant.x, gain: 2}]\n"),
            "15:17: the signal 'fault.f' is already written by module fault; give the fault another name\n");
  EXPECT_EQ(mistakes_of(modules + "stimuli: [{name: s, drives: control.u, sequence: [{hold: 1 m}]}]\n"),
            "15:18: the signal 'stimulus.s' is already written by module stimulus; give the stimulus another "
            "name\n");
}

TEST_F(InjectionMistakes, ConstantsWithoutAValueAreReported) {
  for (const char* section : {"faults: [{name: f, signal: plant.x, stuck: 0 / 0 * 1 m}]",
                              "stimuli: [{name: s, drives: control.u, sequence: [{hold: 0 / 0 * 1 m}]}]",
                              "faults: [{name: f, signal: plant.x, offset: 1 m, when: 0 / 0 > 1}]"})
    EXPECT_NE(mistakes_of(std::string(section) + "\n").find("has no value"), std::string::npos) << section;
}

TEST_F(InjectionMistakes, AreRowsOfAStimulusThatTheRunDoesNotReach) {
  const std::string stimulus =
      "stimuli: [{name: s, drives: control.u, at: 400 ms, file: {path: p.csv, column: level}}]";
  folder_.write("p.csv", "time;level\n0.599;1\n5;2\n");
  EXPECT_EQ(mistakes_of(stimulus), "") << "the row of the last tick";
  folder_.write("p.csv", "time;level\n0.6;1\n5;2\n");
  const std::string late = mistakes_of(stimulus);
  EXPECT_NE(
      late.find("p.csv:2:1: the time of the first row is 1 s of the run, which is not before the end of "
                "the run, which takes 1 s"),
      std::string::npos)
      << late;
}

}  // namespace
}  // namespace hil::injection
