// Conditions by space: faults that begin by distances, contacts, times to impact, regions and beams.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// Two boxes of 2 m. `mover` comes along x at 10 m/s, from 20.005 m, and passes through `rock` at the origin.
/// Its borders cross those of others half a tick after whole ticks.
constexpr const char* spatial_scenario = R"(
scenario: by space
clock: virtual
base_rate: 1 kHz
duration: 2.5 s
world:
  layers: [body]
  entities:
    - {name: rock, shape: {box: [2 m, 2 m, 2 m]}, mask: [body]}
    - {name: mover, shape: {box: [2 m, 2 m, 2 m]}, position: [20.005 m, 0 m, 0 m],
       velocity: [-10 m/s, 0 m/s, 0 m/s], mask: [body]}
  regions:
    - {name: gate, center: [10 m, 0 m, 0 m], size: [2 m, 4 m, 4 m]}
    - {name: garage, center: [10 m, 0 m, 0 m], size: [3 m, 4 m, 4 m], whole: true}
    - {name: trailer, center: [-5 m, 0 m, 0 m], size: [2 m, 4 m, 4 m], carrier: mover}
  beams:
    - {name: ahead, carrier: rock, origin: [1.5 m, 0 m, 0 m], range: 10 m}
    - {name: through, carrier: rock, range: 12 m}
tasks:
  - module: plant
    type: block
    rate: 1 kHz
    parameters: {outputs: {x: 1 m}}
  - module: reader
    type: block
    rate: 1 kHz
    inputs: {x: plant.x}
    parameters: {inputs: {x: m}, outputs: {y: x}}
faults:
  - {name: near, signal: plant.x, offset: 1 m, while: 'distance(rock, mover) < 5 m'}
  - {name: touching, signal: plant.x, offset: 1 m, while: 'contact(mover, rock)'}
  - {name: urgent, signal: plant.x, offset: 1 m, when: 'time_to_impact(rock, mover, 1 s) < 500 ms', for: 100 ms}
  - {name: gate, signal: plant.x, offset: 1 m, while: 'inside(mover, gate)'}
  - {name: garage, signal: plant.x, offset: 1 m, while: 'inside(mover, garage)'}
  - {name: trailer, signal: plant.x, offset: 1 m, while: 'inside(rock, trailer)'}
  - {name: ahead, signal: plant.x, offset: 1 m, while: 'sees(ahead, mover)'}
expectations:
  - {name: passes, eventually: 'distance(rock, mover) < -1 m'}
  - {name: is near, always: 'distance(rock, mover) < 5 m', after: 'distance(rock, mover) < 5 m'}
  - {name: touches, always: 'contact(rock, mover)', between: [1801 ms, 2199 ms]}
  - {name: touches not yet, never: 'contact(rock, mover)', between: [1 ms, 1800 ms]}
  - {name: touches no longer, never: 'contact(rock, mover)', between: [2201 ms, 2499 ms]}
  - {name: will touch, always: 'abs(time_to_impact(mover, rock) - (1.8005 s - time)) < 1 ms', between: [801 ms, 1800 ms]}
  - {name: in the gate, always: 'inside(mover, gate)', between: [801 ms, 1200 ms]}
  - {name: seen, always: 'sees(ahead, mover)', between: [751 ms, 1950 ms], coverage: 100 %}
  - {name: seen through its carrier, always: 'sees(through, mover)', between: [701 ms, 2100 ms], coverage: 100 %}
  - {name: not seen before, never: 'sees(through, mover)', between: [1 ms, 700 ms], coverage: 100 %}
  # Names of signals, with other blanks.
  - {name: at least, statistics: {signal: 'distance( rock,mover )', mean: {max: 100 m}}}
plots: [{title: distance, signals: ['distance(rock,mover)', 'time_to_impact(rock, mover, 1000 ms)']}]
recording: {signals: ['distance(mover,rock)']}
)";

/// The instants of an event, in ms.
std::vector<std::int64_t> instants_of(const nlohmann::json& report, const std::string& event) {
  std::vector<std::int64_t> instants;
  for (const auto& one : report["events"])
    if (one["text"].get<std::string>().starts_with(event))
      instants.push_back(one["time_ns"].get<std::int64_t>() / 1'000'000);
  return instants;
}

TEST(BySpace, FaultsBeginAndEndAtTheirInstants) {
  const Folder folder;
  write_text(folder / "s.yaml", spatial_scenario);
  const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  // Half a tick after these ms; the module's outputs of the tick after that are conditions of the next one.
  const auto expect = [&](const std::string& fault, std::int64_t begin_ms, std::int64_t end_ms) {
    const auto begins = instants_of(report, "fault " + fault + " begins");
    const auto ends = instants_of(report, "fault " + fault + " ends");
    ASSERT_EQ(begins.size(), 1u) << fault;
    EXPECT_EQ(begins[0], begin_ms + 2) << fault;
    ASSERT_EQ(ends.size(), 1u) << fault;
    EXPECT_EQ(ends[0], end_ms + 2) << fault;
  };
  // The front of the mover is at 19.005 m - 10 m/s t.
  expect("touching", 1'800, 2'200);
  expect("urgent", 1'300, 1'400);
  expect("gate", 800, 1'200);
  expect("garage", 950, 1'050);
  expect("trailer", 1'300, 1'700);
  expect("ahead", 750, 1'950);
  const auto near = instants_of(report, "fault near begins");
  ASSERT_EQ(near.size(), 1u);
  EXPECT_EQ(near[0], 1'302);
  EXPECT_TRUE(instants_of(report, "fault near ends").empty());
}

/// Crossings between ticks. A dart of 1 m flies through a loop of 2 m at 400 m/s; an accelerating car commits
/// in each tick.
constexpr const char* crossings_scenario = R"(
scenario: crossings
clock: virtual
base_rate: 1 kHz
duration: 200 ms
world:
  layers: [vehicle, dart, static]
  entities:
    - {name: dart, shape: {box: [1 m, 1 m, 1 m]}, position: [-21.7 m, 0 m, 0 m],
       velocity: [400 m/s, 0 m/s, 0 m/s], mask: [dart]}
    - {name: post, shape: {box: [1 m, 1 m, 1 m]}, position: [10 m, 0 m, 0 m], mask: [static]}
  regions:
    - {name: gate, center: [0 m, 0 m, 0 m], size: [2 m, 4 m, 4 m]}
    - {name: ahead, center: [5 m, 0 m, 0 m], size: [2 m, 4 m, 4 m], carrier: dart}
    - {name: all_ahead, center: [5 m, 0 m, 0 m], size: [2 m, 4 m, 4 m], carrier: dart, whole: true}
tasks:
  - module: traffic
    type: vehicles
    rate: 1 kHz
    parameters: {vehicles: {car: {position: [0 m, 90 m], speed: 1 m/s, desired_speed: 50 m/s}}}
  - module: loops
    type: detectors
    rate: 50 Hz
    parameters: {layers: [dart], loops: {gate: {center: [0 m, 0 m, 0 m], size: [2 m, 4 m, 4 m]}}}
variables:
  stay: loops.gate.left_at - loops.gate.entered_at
expectations:
  - {name: no tick sees it over the loop, always: loops.gate == 0, coverage: 100 %}
  - {name: it came, always: abs(loops.gate.entered_at - 50.5 ms) < 1 us, between: [61 ms, 199 ms]}
  - {name: it stayed, always: abs(stay - 7.5 ms) < 1 us, between: [61 ms, 199 ms]}
  - {name: it is counted, count: {of: known(loops.gate.entered_at), min: 1, max: 1}}
  - {name: first the rear, always: 'abs(crossed_at(dart, gate) - 50.5 ms) < 1 us', between: [52 ms, 57 ms]}
  - {name: then the front, always: 'abs(crossed_at(dart, gate) - 58 ms) < 1 us', between: [60 ms, 199 ms]}
  # The post is 31.7 m - 400 m/s t ahead of the dart.
  - {name: comes near, always: 'abs(crossed_at(post, ahead) - 63 ms) < 1 us', between: [65 ms, 69 ms]}
  - {name: is passed, always: 'abs(crossed_at(post, ahead) - 70.5 ms) < 1 us', between: [72 ms, 199 ms]}
  - {name: is near, always: 'abs(crossed_at(post, all_ahead) - 65.5 ms) < 1 us', between: [67 ms, 68 ms]}
  - {name: goes, always: 'abs(crossed_at(post, all_ahead) - 68 ms) < 1 us', between: [70 ms, 199 ms]}
)";

TEST(BySpace, CrossingsBetweenTicksHaveTheirInstantsAndAreCounted) {
  const ScenarioFolder scenario(crossings_scenario);
  const Ended ended = scenario.run("out");
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(scenario.folder / "out");
  const auto& rows = report["sections"][0]["tables"][0]["rows"];
  ASSERT_EQ(rows.size(), 1u) << report["sections"];
  EXPECT_EQ(rows[0][0]["text"], "gate");
  EXPECT_EQ(rows[0][1]["number"], 1.0);
  EXPECT_EQ(rows[0][2]["number"], 1.0);
  ASSERT_EQ(scenario.run("again").code, 0);
  EXPECT_EQ(read_text(scenario.folder / "out/signals.csv"), read_text(scenario.folder / "again/signals.csv"));
}

/// Two cars, which consist of two convex parts each, and which pass one another before the crossing.
constexpr const char* cars_scenario = R"(
scenario: two cars
clock: virtual
base_rate: 1 kHz
duration: 5 s
world:
  layers: [vehicle]
tasks:
  - module: traffic
    type: vehicles
    rate: 1 kHz
    parameters:
      vehicles:
        east: {position: [-40 m, -1.75 m], heading: 0 deg, speed: 6 m/s, desired_speed: 6 m/s}
        north: {position: [1.75 m, -30 m], heading: 90 deg, speed: 12 m/s, desired_speed: 12 m/s}
  - module: plant
    type: block
    rate: 1 kHz
    parameters: {outputs: {x: 1 m}}
  - module: reader
    type: block
    rate: 1 kHz
    inputs: {x: plant.x}
    parameters: {inputs: {x: m}, outputs: {y: x}}
faults:
  - {name: near, signal: plant.x, offset: 1 m, while: 'distance(traffic.east, traffic.north) < 25 m'}
expectations:
  - {name: no contact, never: 'contact(traffic.east, traffic.north)', coverage: 100 %}
  - {name: no impact, never: 'time_to_impact(traffic.east, traffic.north, 1 s) < 1 s', coverage: 100 %}
)";

/// Between the bodies of two cars of 4.5 m x 1.8 m, one along x and one along y.
double distance_of_cars(double dx_m, double dy_m) {
  constexpr double reach_m = 0.5 * (4.5 + 1.8);
  return std::hypot(std::max(std::abs(dx_m) - reach_m, 0.0), std::max(std::abs(dy_m) - reach_m, 0.0));
}

TEST(BySpace, DistanceOfBodiesOfSeveralPartsIsKnownThroughout) {
  const Folder folder;
  write_text(folder / "s.yaml", cars_scenario);
  const Ended ended = run_hil({"run", folder / "s.yaml", "--out", folder / "out"});
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(instants_of(report, "fault near begins").size(), 1u);
  EXPECT_EQ(instants_of(report, "fault near ends").size(), 1u);
  const Signals signals(folder / "out");
  const auto difference = [&](const std::string& axis, std::size_t row) {
    return signals["traffic.north." + axis][row] - signals["traffic.east." + axis][row];
  };
  ASSERT_EQ(signals.rows(), 500u);
  for (std::size_t row = 0; row < signals.rows(); ++row)
    EXPECT_NEAR(signals["distance(traffic.east, traffic.north)"][row],
                distance_of_cars(difference("x", row), difference("y", row)), 0.02)
        << row;
}

}  // namespace
}  // namespace hil::scenario_test
