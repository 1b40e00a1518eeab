// Under the virtual clock a condition sees each frame once: before the tick that has its values, and after
// the tick that caused it.

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// A frame of State every 10 ms: 0, from 300 ms on 1 for one frame, and from 500 ms on 2.
std::string log() {
  std::string lines;
  for (int ms = 0; ms < 1000; ms += 10) {
    char line[64];
    std::snprintf(line, sizeof line, "(%d.%03d000) car 200#%02X\n", ms / 1000, ms % 1000,
                  ms == 300   ? 1
                  : ms >= 500 ? 2
                              : 0);
    lines += line;
  }
  return lines;
}

constexpr const char* scenario = R"yaml(scenario: order of frames
base_rate: 1 kHz
duration: 1 s
clock: virtual
can:
  - bus: car
    device: virtual
    database: bus.dbc
    rate: 1 kHz
    play: played.log
    receive: [{message: State, timeout: 50 ms}]
variables:
  changes: count(changed(can.car.State.S))
expectations:
  - {name: begins once, count: {of: can.car.State.S == 2, min: 1, max: 1}}
  - {name: pulses once, count: {of: can.car.State.S == 1, min: 1, max: 1}}
  - {name: rises twice, count: {of: rise(can.car.State.S > 0), min: 2, max: 2}}
  - {name: never goes back, never: previous(can.car.State.S) == 2 and can.car.State.S == 0}
  - {name: stays, always: can.car.State.S == 2, after: can.car.State.S == 2}
  - {name: pulse lasts, eventually: duration(can.car.State.S == 1) > 8.5 ms}
  - {name: pulse ends, never: duration(can.car.State.S == 1) > 11 ms}
  - {name: no other state, never: count(can.car.State.S > 2) > 0}
  - {name: no latch, never: "latch(can.car.State.S > 2, false)"}
  - {name: integral is known, never: integral(can.car.State.S) > 5 s}
  - {name: changes thrice, always: changes == 3, between: [510 ms, 1 s]}
  - {name: has no gap, count: {of: known(can.car.State.S), min: 1, max: 1}}
  - {name: the last one is seen, eventually: can.car.State.S == 2, between: [990 ms, 1 s]}
)yaml";

TEST(FrameOrder, EachFrameIsSeenOnceAndNothingElse) {
  const Folder folder;
  write_text(folder / "s.yaml", scenario);
  write_text(folder / "played.log", log());
  write_text(folder / "bus.dbc",
             "VERSION \"\"\nBU_: A B\nBO_ 512 State: 1 A\n SG_ S : 0|8@1+ (1,0) [0|255] \"\" B\n");
  const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  for (const auto& expectation : read_report(folder / "out")["expectations"])
    EXPECT_EQ(expectation["result"], "held") << expectation.dump(1);
}

/// The last tick is at 99 ms: the reply at 99.5 ms comes after it, and its request was due at 99.9 ms.
TEST(FrameOrder, FramesAfterTheLastTickAreJudged) {
  const Folder folder;
  write_text(folder / "s.yaml", R"yaml(scenario: last frames
base_rate: 1 kHz
duration: 100 ms
clock: virtual
can:
  - bus: car
    device: virtual
    database: bus.dbc
    rate: 1 kHz
    play: played.log
    receive: [{message: Query, timeout: 0 ms}, {message: Reply, timeout: 0 ms}, {message: Beat, timeout: 50 ms}]
expectations:
  - {name: replies, response: {request: can.car.Query.N, reply: can.car.Reply.N, within: 10 ms, at_least: 2}}
  - {name: beats, cycle_time: {message: can.car.Beat, period: 30 ms, tolerance: 1 ms, at_least: 3}}
)yaml");
  write_text(folder / "bus.dbc",
             "VERSION \"\"\nBU_: A B\n"
             "BO_ 1 Query: 1 A\n SG_ N : 0|8@1+ (1,0) [0|255] \"\" B\n"
             "BO_ 2 Reply: 1 A\n SG_ N : 0|8@1+ (1,0) [0|255] \"\" B\n"
             "BO_ 3 Beat: 1 A\n SG_ N : 0|8@1+ (1,0) [0|255] \"\" B\n");
  const std::string replied =
      "(0.009500) car 003#01\n(0.010500) car 001#01\n(0.020400) car 002#01\n"
      "(0.039500) car 003#01\n(0.069500) car 003#01\n(0.089900) car 001#02\n";
  write_text(folder / "played.log", replied + "(0.099500) car 003#01\n(0.099500) car 002#02\n");
  Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;

  write_text(folder / "played.log", replied);
  ended = run_hil({"run", folder / "s.yaml", "--out", folder / "missing"});
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  const auto expectations = read_report(folder / "missing")["expectations"];
  EXPECT_EQ(expectations[0]["result"], "failed") << expectations[0].dump(1);
  EXPECT_EQ(expectations[1]["result"], "failed") << expectations[1].dump(1);
}

}  // namespace
}  // namespace hil::scenario_test
