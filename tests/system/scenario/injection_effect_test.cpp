// Stimuli and faults that began and changed nothing that anything read: the run is not checked, and one
// sentence says which, when, and for whom.

#include <gtest/gtest.h>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// `plant` writes x at 10 kHz; `plc` reads it, and the free input u, at 100 Hz; a bus sends it every 20 ms.
const std::string plant_and_plc = std::string(R"(
scenario: effects
clock: virtual
base_rate: 10 kHz
duration: 100 ms
tasks:
  - module: plant
    type: block
    rate: 10 kHz
    parameters: {outputs: {x: time * 1 m/s2, still: 1 m/s}}
  - module: plc
    type: block
    rate: 100 Hz
    inputs: {x: plant.x, still: plant.still}
    parameters: {inputs: {x: m/s, still: m/s, u: {unit: m/s, initial: 0}}, outputs: {y: x + u + still}}
can:
  - bus: car
    device: virtual
    database: )") + HIL_SOURCE_DIR +
                                  R"(/configs/crossing/crossing.dbc
    rate: 1 kHz
    send:
      - {message: EgoStatus, period: 20 ms, signals: {Speed: plant.x, YawRate: 0}}
)";

struct Outcome {
  int code = 0;
  std::string output;
  nlohmann::json report;
  std::string directory;
};

Outcome outcome_of(const Folder& folder, const std::string& sections) {
  write_text(folder / "s.yaml", plant_and_plc + sections);
  const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  Outcome outcome{
      .code = ended.code, .output = ended.output + ended.errors, .report = {}, .directory = folder / "out"};
  if (ended.code < 2) outcome.report = read_report(outcome.directory);
  return outcome;
}

TEST(InjectionEffect, WithoutOneTheRunIsNotChecked) {
  const struct {
    std::string sections, sentence;
  } all[] = {
      {"faults: [{name: f, signal: plant.x, stuck: 5 m/s, at: 30.2 ms, for: 0.6 ms}]",
       "fault 'f' was active from 30.2 ms to 30.8 ms, but none of its readers took a value in that time "
       "(plc.x "
       "every 10 ms and can.car.EgoStatus.Speed every 20 ms)"},
      // The bus has ten releases in this time, and no frame is due.
      {"faults: [{name: f, signal: plant.x, offset: 1 m/s, at: 21 ms, for: 9 ms}]",
       "but none of its readers took a value in that time"},
      {"faults: [{name: f, signal: plant.still, stuck: last, at: 30 ms, for: 30 ms}]",
       "fault 'f' was active from 30 ms to 60 ms, but each value that its readers took in that time was the "
       "true one (plc.still every 10 ms)"},
      {"faults: [{name: f, signal: plant.x, noise: 1 m/s, at: 1.2 ms, for: 0.2 ms, every: 10 ms, times: 3}]",
       "fault 'f' was active 3 times, first from 1.2 ms to 1.4 ms, but none"},
      // A later fault replaces what the first one does.
      {"faults:\n  - {name: f, signal: plant.x, offset: 1 m/s, at: 25 ms, for: 30 ms}\n"
       "  - {name: g, signal: plant.x, stuck: 5 m/s, at: 20 ms, for: 40 ms}",
       "fault 'f' was active from 25 ms to 55 ms, but fault 'g' replaced what it did, so the run"},
      {"faults:\n  - {name: f, signal: plant.x, stuck: -1 m/s}\n"
       "  - {name: g, signal: plant.x, stuck: -1 m/s}",
       "fault 'f' was active from 0 to 100 ms, but fault 'g' replaced what it did, so the run"},
      // The value at which g is stuck has what f did, and not what h did.
      {"faults:\n  - {name: f, signal: plant.x, offset: 1 m/s, at: 10 ms}\n"
       "  - {name: h, signal: plant.x, offset: 1 m/s, at: 30 ms}\n"
       "  - {name: g, signal: plant.x, stuck: last, at: 20.1 ms}",
       "fault 'h' was active from 30 ms to 100 ms, but fault 'g' replaced what it did, so the run"},
      // Two that cancel each other.
      {"faults:\n  - {name: f, signal: plant.x, offset: 1 m/s}\n"
       "  - {name: g, signal: plant.x, offset: -1 m/s}",
       "fault 'f' was active from 0 to 100 ms, but each value that its readers took in that time was the "
       "true one"},
      {"faults:\n  - {name: f, signal: plant.x, offset: 1 m/s}\n"
       "  - {name: g, signal: plant.x, offset: -1 m/s}",
       "fault 'g' was active from 0 to 100 ms, but each value that its readers took in that time was the "
       "true one"},
      {"faults:\n  - {name: f, signal: plant.x, dropout: 0.0001 %}\n"
       "  - {name: g, signal: plant.x, offset: -1 m/s}",
       "fault 'f' was active from 0 to 100 ms, but it dropped none of the values that its readers took"},
      {"faults: [{name: f, signal: plant.x, offset: 1 m/s, at: 1 ms, for: 1 ms, every: 10 ms, probability: "
       "0.001 %}]",
       "fault 'f' never began: it was drawn 10 times, with a probability of 0.001 %, so the run"},
      {"stimuli: [{name: s, drives: plc.u, when: time > 50 ms, sequence: [{hold: 5 m/s, for: 50 ms}, {name: "
       "late, hold: 0 m/s}]}]",
       "but its part 'late' never began, so the run"},
      {"faults: [{name: f, task: plc, takes_longer: 1 ms, at: 31 ms, for: 8 ms}]",
       "fault 'f' was active from 31 ms to 39 ms, but no step of the task was in that time (every 10 ms)"},
      {"faults: [{name: f, message: can.car.EgoStatus, drop: 100 %, at: 21 ms, for: 18 ms}]",
       "fault 'f' was active from 21 ms to 39 ms, but no frame or request came in that time"},
      {"faults: [{name: f, message: can.car.EgoStatus, drop: 0.0001 %}]",
       "but it made no difference to the frames or requests that came in that time (5)"},
      {"faults:\n  - {name: f, message: can.car.EgoStatus, flip_bits: [0]}\n"
       "  - {name: g, message: can.car.EgoStatus, flip_bits: [0]}",
       "fault 'g' was active from 0 to 100 ms, but it made no difference to the frames or "
       "requests that came in that time (5)"},
      {"faults:\n  - {name: f, message: can.car.EgoStatus, drop: 100 %}\n"
       "  - {name: g, message: can.car.EgoStatus, flip_bits: [0]}",
       "fault 'g' was active from 0 to 100 ms, but fault 'f' let no frame of it through in that time"},
      {"faults:\n  - {name: f, message: can.car.EgoStatus, flip_bits: [0]}\n"
       "  - {name: g, device: can.car, state: bus_off}",
       "fault 'f' was active from 0 to 100 ms, but fault 'g' let no frame of it through in that time"},
      {"faults: [{name: f, device: can.car, state: bus_off, at: 21 ms, for: 18 ms}]",
       "fault 'f' was active from 21 ms to 39 ms, but no frame or request came in that time"},
      {"stimuli: [{name: s, drives: plc.u, sequence: [{hold: 5 m/s, for: 0.4 ms}, {hold: 0 m/s, for: 0.4 "
       "ms}], "
       "at: "
       "30.2 ms, for: 0.8 ms}]",
       "stimulus 's' was active from 30.2 ms to 31 ms, but 'plc.u' (read every 10 ms) was not read in "
       "that time"},
      {"stimuli: [{name: s, drives: plc.u, sequence: [{hold: 5 m/s, for: 30.2 ms}, {name: peak, hold: 9 m/s, "
       "for: 2 "
       "ms}, {hold: 0 m/s}]}]",
       "stimulus 's' was active from 0 to 100 ms, but 'plc.u' (read every 10 ms) was not read "
       "during its part 'peak'"},
      // The stimulus is there for its reader, but a fault keeps it away.
      {"stimuli: [{name: s, drives: plc.u, sequence: [{hold: 5 m/s}], at: 30 ms, for: 20 ms, until: time < 0 "
       "s}]\n"
       "faults: [{name: f, signal: plc.u, stuck: 1 m/s, at: 20 ms}]",
       "stimulus 's' was active from 30 ms to 50 ms, but fault 'f' replaced each value of it for 'plc.u' "
       "(read "
       "every 10 ms)"},
  };
  for (const auto& [sections, sentence] : all) {
    const Folder folder;
    const Outcome outcome = outcome_of(folder, sections);
    EXPECT_EQ(outcome.code, 1) << sections << '\n' << outcome.output;
    EXPECT_NE(outcome.output.find(sentence), std::string::npos) << sections << '\n' << outcome.output;
    EXPECT_NE(outcome.output.find("so the run does not check what it is for"), std::string::npos);
  }
}

TEST(InjectionEffect, NeedsOnlyOneReadOrOneFrame) {
  for (const char* const sections : {
           "faults: [{name: f, signal: plant.x, stuck: 5 m/s, at: 29.9 ms, for: 0.2 ms}]",
           // The frame of 40 ms alone: the step of plc is in none of the ticks.
           "faults: [{name: f, signal: plant.x, offset: 1 m/s, at: 40 ms, for: 0.1 ms, readers: [can.car]}]",
           "faults: [{name: f, task: plc, takes_longer: 1 ms, at: 30 ms, for: 0.1 ms}]",
           "faults: [{name: f, message: can.car.EgoStatus, drop: 100 %, at: 40 ms, for: 1 ms}]",
           // The run ends before the frames are due.
           "faults: [{name: f, message: can.car.EgoStatus, delay: 50 s}]",
           "faults: [{name: f, device: can.car, state: bus_off, at: 40 ms, for: 1 ms}]",
           "stimuli: [{name: s, drives: plc.u, sequence: [{hold: 5 m/s}], at: 30 ms, for: 0.1 ms}]",
           // The value stays after the end.
           "stimuli: [{name: s, drives: plc.u, sequence: [{hold: 5 m/s}], at: 31 ms, for: 0.1 ms}]",
       }) {
    const Folder folder;
    const Outcome outcome = outcome_of(folder, sections);
    EXPECT_EQ(outcome.code, 0) << sections << '\n' << outcome.output;
    const char* const list = outcome.report["faults"].empty() ? "stimuli" : "faults";
    EXPECT_EQ(outcome.report[list][0]["took_effect"], true) << sections;
    EXPECT_EQ(outcome.report[list][0]["missing_effect"], "") << sections;
  }
}

TEST(InjectionEffect, ExpectationsSeeTheFaultyValueOnTheTicksOfTheirWindows) {
  const std::string fault = "faults: [{name: f, signal: plant.x, offset: 1 m/s, at: 31 ms, for: 1 ms}]\n";
  const Folder folder;
  EXPECT_EQ(outcome_of(folder, fault + "expectations: [{name: e, never: plant.x.faulted > 2 m/s}]").code, 0);
  const std::string by_variable = "variables: {wrong: plant.x.faulted > 1 m/s}\n";
  EXPECT_EQ(
      outcome_of(folder, fault + by_variable + "expectations: [{name: e, eventually: wrong == 1}]").code, 0);
  const Outcome before = outcome_of(
      folder, fault + "expectations: [{name: e, never: plant.x.faulted > 2 m/s, between: [0 s, 30 ms]}]");
  EXPECT_EQ(before.code, 1) << before.output;
  EXPECT_NE(
      before.output.find("(plc.x every 10 ms, can.car.EgoStatus.Speed every 20 ms and expectation 'e')"),
      std::string::npos)
      << before.output;
  // Nothing else reads it.
  const std::string of_output = "faults: [{name: f, signal: plc.y, offset: 1 m/s}]\n";
  EXPECT_EQ(outcome_of(folder, of_output + "expectations: [{name: e, never: plc.y.faulted > 9 m/s}]").code,
            0);
  EXPECT_EQ(outcome_of(folder, of_output + "expectations: [{name: e, never: plc.y > 9 m/s}]").code, 2);
}

TEST(InjectionEffect, OfAProcessThatHasEndedIsNone) {
  const Folder folder;
  write_text(folder / "s.yaml", R"(scenario: ended
duration: 500 ms
realtime: {max_lost: 100 %}
processes: {ecu: {command: ["true"], may_be_lost: true}}
faults: [{name: f, process: ecu, state: paused, at: 400 ms, for: 50 ms}]
)");
  const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_NE(ended.output.find("fault 'f' was active from"), std::string::npos) << ended.output;
  EXPECT_NE(ended.output.find("but the process had ended at"), std::string::npos) << ended.output;
}

TEST(InjectionEffect, IsInAllReports) {
  const Folder folder;
  const Outcome outcome =
      outcome_of(folder,
                 "faults:\n  - {name: f, signal: plant.x, stuck: 5 m/s, at: 31 ms, for: 1 ms}\n"
                 "  - {name: g, signal: plant.x, stuck: 5 m/s, at: 30 ms, for: 1 ms}\n"
                 "  - {name: h, signal: plant.still, stuck: last}\n");
  EXPECT_EQ(outcome.code, 1) << outcome.output;
  EXPECT_EQ(outcome.report["faults"][0]["took_effect"], false);
  EXPECT_EQ(outcome.report["faults"][1]["took_effect"], true);
  const std::string sentence = "none of its readers took a value in that time (plc.x every 10 ms";
  const std::string other =
      "each value that its readers took in that time was the true one (plc.still every 10 ms)";
  EXPECT_EQ(std::string(outcome.report["faults"][0]["missing_effect"]).find(sentence), 0u);
  for (const std::string& text :
       {outcome.output, read_text(outcome.directory + "/run.log"),
        read_text(outcome.directory + "/report.html"), read_text(outcome.directory + "/junit.xml")}) {
    EXPECT_NE(text.find(sentence), std::string::npos) << text;
    EXPECT_NE(text.find(other), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace hil::scenario_test
