#pragma once
// A scenario that uses every part of the language, with its files.

#include "config_fixture.hpp"
#include "runtime/buses/bus.hpp"
#include "runtime/buses/can/can_section.hpp"
#include "runtime/buses/modbus/modbus_section.hpp"
#include "runtime/buses/modbus/register_map_file.hpp"
#include "runtime/expectations/instants.hpp"
#include "runtime/expectations/kinds.hpp"
#include "runtime/injection/signal_fault.hpp"
#include "runtime/injection/waveform.hpp"

namespace hil::config::test {

inline constexpr const char* register_map_text = R"(registers:
  - {name: detector, table: holding, address: 0, type: u16, access: write, about: "a loop"}
  - {name: time_ms, table: holding, address: 10, type: u32, word_order: CDAB, access: write, unit: ms}
  - {name: alive, table: holding, address: 12, type: u16, access: write}
  - {name: light, table: input, address: 0, type: i16, scale: 0.5, offset: -1, minimum: -2, maximum: 9, access: read}
  - {name: demand, table: discrete_input, address: 0, type: bool, access: read}
)";

inline constexpr const char* scenario_text = R"(scenario: everything
about: uses every part of the language
base_rate: 1 kHz
duration: 10 s
clock: realtime
seed: 7

realtime: {scheduler: other, priority: 42, lock_memory: false, cpus: [0, 1], watchdog: 250 ms}

world:
  gpu: llvmpipe
  retained_changes: 65536
  max_entities: 100
  entities:
    - {name: ground, shape: {box: [400 m, 300 m, 20 cm]}, position: [0 m, 0 m, -0.1 m], mask: [ground]}
    - name: pole
      shape: {cylinder: {radius: 10 cm, height: 6 m}}
      rotation: {yaw: 90 deg}
      velocity: [36 km/h, 0 m/s, 0 m/s]
      angular_velocity: [0 deg/s, 0 deg/s, 180 deg/s]
      scale: 2
    - {name: ball, shape: {sphere: 1 m}, rotation: {quaternion: [0, 0, 0, 1]}, mask: [static, ground]}
    - {name: sheet, shape: {rectangle: [2 m, 3 m]}}
    - {name: house, shape: {file: {path: house.obj, scale: 0.001}}}

tasks:
  - module: traffic
    type: vehicles
    rate: 1 kHz
    parameters: {cars: 3}
    inputs:
      brake_request: can.car.BrakeCommand.Deceleration
  - module: scanner
    type: laser_scanner
    rate: 100 Hz
    offset: 2 ms
    thread: scanner
    deadline: 10 ms
    budget: 8 ms
    overrun: queue
    warmup: 5
    parameters: {columns: 140, range: 80 m}

can:
  - bus: car
    device: virtual
    database: crossing.dbc
    rate: 100 Hz
    priority: 55
    send:
      - message: EgoStatus
        period: 20 ms
        offset: 10 ms
        counter: Counter
        checksum: Checksum
        signals: {Speed: traffic.ego_speed, Mode: 3}
        safe: {Speed: -1.5}
    receive: [BrakeCommand, {message: Status, timeout: 1 s, safe: {State: 4}}]
    faults: {drop: 0.25, delay: 3 ms, corrupt: 0.125}
  - {bus: bench, device: "socketcan:vcan0", database: crossing.dbc, rate: 50 Hz}

modbus:
  - unit: plc
    device: 127.0.0.1:auto
    registers: map.yaml
    rate: 20 Hz
    max_age: 2 s
    run_time: time_ms
    heartbeat: alive
    write: {detector: detectors.ego}
    read: [light, demand]

dut:
  command: [controller, --bus, "{can.car}", "--map={modbus.plc}/{can.bench}"]

processes:
  plc:
    enabled: false
    command: [plc, "{modbus.plc}"]
    safe_on_exit: false
    start_timeout: 3 s

expectations:
  - {name: no collision, never: "collision.ego > 0"}
  - {name: alive, always: "ego.speed >= 0 and ego.speed < 50"}
  - {name: it stops, eventually: "ego.speed == 0", by: 9 s}
  - name: it answers
    response: {request: can.car.Objects.Counter, reply: can.car.BrakeCommand.AnswerTo, within: 50 ms, at_least: 10}
  - name: it lasts
    reaction: {when: ego.brake > 0, then: ego.speed < 5, within: 1 s, for_at_least: 2 s}
    between: [1 s, 9 s]
    after: ego.demand > 0
    until: ego.speed == 0
  - {name: twice, count: {of: ego.speed < 5, min: 1, max: 2}, coverage: 80 %}
  - {name: first, order: [ego.demand > 0, ego.brake > 0]}
  - {name: regular, cycle_time: {message: can.car.BrakeCommand, period: 25 ms, tolerance: 2 ms, at_least: 9}}
  - {name: follows, tracks: {signal: ego.speed, reference: curve.csv, column: speed, tolerance: 1, after_shift: 50 ms}}
  - name: on average
    statistics:
      signal: ego.speed
      mean: {min: 1, max: 2}
      overshoot: {of: 5, from: 0, at_most: 5 %}
      settling_time: {of: 5, within: 2 %, at_most: 3 s}
  - {name: comes, fresh: can.car.BrakeCommand}
)";

inline ScenarioTypes test_scenario_types() {
  SchemaOfModules modules{
      {"vehicles",
       Schema::record({Field::with_default("cars", Schema::integer(0, 100), "1", "How many cars.")})},
      {"laser_scanner",
       Schema::record(
           {Field::needed("columns", Schema::integer(1, 4096), "Columns of the scan."),
            Field::needed("range", Schema::quantity(Quantity::length_m, 0.1, 500.0), "Its range.")})}};
  return {.modules = std::move(modules),
          .buses = buses::section_types(),
          .waveforms = injection::waveforms(),
          .faults = injection::signal_fault_kinds(),
          .expectations = expectations::kinds(),
          .table_claims = expectations::table_claims()};
}

inline const buses::can::CanSection& can_of(const Scenario& scenario, std::size_t index) {
  return *sections_of<buses::can::CanSection>(scenario.buses).at(index);
}
inline const buses::modbus::ModbusSection& modbus_of(const Scenario& scenario, std::size_t index) {
  return *sections_of<buses::modbus::ModbusSection>(scenario.buses).at(index);
}

/// scenario.yaml and the files beside it.
class ScenarioFolder {
 public:
  ScenarioFolder() {
    folder_.write("crossing.dbc", "VERSION \"\"\n");
    folder_.write("house.obj", "v 0 0 0\n");
    folder_.write("house.stl", "");
    folder_.write("curve.csv", "time,speed,other\n0,1,2\n9,3,4\n");
    folder_.write("map.yaml", register_map_text);
    folder_.write("served.yaml",
                  "registers: [{name: mode, table: holding, address: 0, type: u16, access: read}]\n");
  }

  const tests::TemporaryFolder& folder() const { return folder_; }

  std::optional<Scenario> load(std::string_view text, Diagnostics& diagnostics,
                               const std::vector<std::string>& overrides = {}) const {
    return load_scenario(folder_.write("scenario.yaml", text), overrides, test_scenario_types(), diagnostics);
  }

 private:
  tests::TemporaryFolder folder_;
};

/// The text with `from`, which it contains once, replaced by `to`.
inline std::string with_change(const std::string& from, const std::string& to,
                               std::string text = scenario_text) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos || text.find(from, at + 1) != std::string::npos) {
    throw std::runtime_error("not exactly once in the text: " + from);
  }
  return text.replace(at, from.size(), to);
}

}  // namespace hil::config::test
