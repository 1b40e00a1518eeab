// Writers and readers of signals: every mistake has its place and the nearest existing name.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <variant>

#include "runtime/buses/can/can_wiring.hpp"
#include "runtime/buses/modbus/modbus_settings.hpp"
#include "tests/paths.h"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"
#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::run {
namespace {

const char* const database_text = R"(VERSION ""
BU_: HIL ECU
BO_ 256 EgoStatus: 8 HIL
 SG_ Speed : 0|16@1- (0.01,0) [-100|100] "m/s" ECU
 SG_ Mode : 16|4@1+ (1,0) [0|15] "" ECU
 SG_ Counter : 32|4@1+ (1,0) [0|15] "" ECU
 SG_ Checksum : 56|8@1+ (1,0) [0|255] "" ECU
BO_ 768 BrakeCommand: 8 ECU
 SG_ Deceleration : 0|16@1+ (0.01,0) [0|20] "m/s2" HIL
 SG_ AnswerTo : 16|16@1+ (1,0) [0|65535] "" HIL
 SG_ Length : 32|8@1+ (1,0) [0|255] "m" HIL
)";

const char* const registers_text = R"(registers:
  - {name: detector, table: holding, address: 0, type: u16, access: write}
  - {name: alive, table: holding, address: 1, type: u16, access: write}
  - {name: light, table: input, address: 0, type: u16, access: read}
)";

const char* const scenario_text = R"(scenario: crossing
base_rate: 1 kHz
duration: 1 s
world:
  layers: [vehicle]
  entities: [{name: rock, shape: {sphere: 1 m}, position: [90 m, 0 m, 0 m], mask: [vehicle]}]
tasks:
  - module: traffic
    type: vehicles
    rate: 1 kHz
    parameters:
      vehicles:
        ego: {position: [0 m, 0 m], speed: 10 m/s, light: east, stop_line: 50 m, braked_from_outside: true}
    inputs:
      light_east: modbus.plc.light
      ego_brake_request: can.car.BrakeCommand.Deceleration
  - module: collision
    type: collision
    rate: 1 kHz
    parameters: {body: traffic.ego, against: [vehicle]}
can:
  - bus: car
    device: virtual
    database: test.dbc
    rate: 100 Hz
    send:
      - message: EgoStatus
        period: 10 ms
        counter: Counter
        checksum: Checksum
        signals: {Speed: traffic.ego.speed, Mode: 3}
        safe: {Mode: 1}
    receive:
      - {message: BrakeCommand, timeout: 200 ms}
modbus:
  - unit: plc
    device: 127.0.0.1:1502
    registers: map.yaml
    rate: 20 Hz
    heartbeat: alive
    write: {detector: collision.hits}
    read: [light]
expectations:
  - {name: no collision, never: collision.total > 0}
  - name: it answers
    response: {request: can.car.EgoStatus.Counter, reply: can.car.BrakeCommand.AnswerTo, within: 50 ms}
)";

class WiringTest : public test::WiringFixture {
 protected:
  WiringTest() {
    folder_.write("test.dbc", database_text);
    folder_.write("map.yaml", registers_text);
  }
  static std::string changed(const std::string& from, const std::string& to,
                             const std::string& text = scenario_text) {
    return WiringFixture::changed(from, to, text);
  }

  /// Whether there is a mistake with `words` at the line and column where `at` begins in the text.
  ::testing::AssertionResult has_mistake(const std::string& text, const std::string& at,
                                         const std::string& words) const {
    const std::size_t index = text.find(at);
    const auto line = static_cast<std::uint32_t>(
        1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(index), '\n'));
    const std::size_t line_begin = index == 0 ? 0 : text.rfind('\n', index - 1) + 1;
    const auto column = static_cast<std::uint32_t>(index - line_begin + 1);
    for (const config::Mistake& mistake : diagnostics_.mistakes()) {
      if (mistake.place.line == line && mistake.place.column == column &&
          mistake.message.find(words) != std::string::npos)
        return ::testing::AssertionSuccess();
    }
    return ::testing::AssertionFailure()
           << "no mistake at " << line << ":" << column << " with \"" << words << "\" in:\n"
           << diagnostics_.to_text();
  }
  /// Whether this is the only mistake of the scenario.
  ::testing::AssertionResult refuses(const std::string& text, const std::string& at,
                                     const std::string& words) {
    if (wired(text) || !is_loaded_) return ::testing::AssertionFailure() << "not refused by the wiring";
    if (diagnostics_.count() != 1)
      return ::testing::AssertionFailure() << "not exactly one mistake:\n" << diagnostics_.to_text();
    return has_mistake(text, at, words);
  }
};

TEST_F(WiringTest, MistakesBeyondTheCapacityOfDiagnosticsRefuseTheScenario) {
  for (const auto& [good, bad] : {std::pair("checksum: Checksum", "checksum: Counter"),
                                  std::pair("safe: {Mode: 1}", "safe: {Moed: 1}")}) {
    config::Diagnostics diagnostics;
    auto scenario = config::load_scenario(folder_.write("scenario.yaml", changed(good, bad)), {},
                                          scenario_types(), diagnostics);
    ASSERT_TRUE(scenario) << diagnostics.to_text();
    for (std::size_t i = 0; i < config::Diagnostics::capacity; ++i)
      diagnostics.add({}, "an earlier mistake");
    EXPECT_FALSE(wire(*scenario, diagnostics)) << bad;
    EXPECT_GT(diagnostics.count(), config::Diagnostics::capacity) << bad;
  }
}

TEST_F(WiringTest, BusesRefuseFaultsOfOtherTypes) {
  const auto refused = [&](const std::string& target, const std::string& effect, const std::string& words) {
    const std::string text =
        scenario_text + std::string("faults: [{name: f, ") + target + ", " + effect + "}]\n";
    const std::string value = effect.substr(effect.find(": ") + 2);
    return refuses(text, value + "}]",
                   "fault 'f' of '" + target.substr(target.find(": ") + 2) + "': " + words);
  };
  EXPECT_TRUE(refused("device: can.car", "state: silent", "a CAN bus can only be bus_off"));
  const std::string of_unit =
      "a Modbus unit can be silent, disconnected, slow ('delay') or answer with an 'exception'";
  EXPECT_TRUE(refused("device: modbus.plc", "state: bus_off", of_unit));
  EXPECT_TRUE(refused("message: modbus.plc.light", "drop: 10 %",
                      "Modbus has no messages; the fault can be one of the unit"));
}

TEST_F(WiringTest, SignalsAreConnectedByName) {
  const auto wiring = wired(scenario_text);
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  const signals::SignalTable& table = wiring->signals;
  const auto id = [&](const char* name) {
    const auto found = table.find(name);
    EXPECT_TRUE(found) << name;
    return found.value_or(signals::SignalId{});
  };
  ASSERT_EQ(wiring->modules.size(), 2U);
  const ModuleTask::Links& traffic = wiring->modules[0].links;
  ASSERT_EQ(traffic.inputs.size(), 3U);
  EXPECT_EQ(traffic.inputs[0].signal, id("modbus.plc.light"));
  EXPECT_EQ(traffic.inputs[1].signal, id("can.car.BrakeCommand.Deceleration"));
  EXPECT_FALSE(traffic.inputs[2].signal.valid()) << "nothing drives the desired speed";
  EXPECT_EQ(traffic.outputs.size(), 5U);
  EXPECT_EQ(traffic.outputs[0], id("traffic.ego.x"));
  EXPECT_DOUBLE_EQ(table.value(id("traffic.ego.speed")), 10.0) << "signals start with their initial values";

  ASSERT_EQ(wiring->buses.size(), 2U);
  const auto& sources = wiring->buses[0].links.outputs;  // Speed, Mode
  ASSERT_EQ(sources.size(), 2U);
  EXPECT_EQ(sources[0].signal, id("traffic.ego.speed"));
  EXPECT_FALSE(sources[1].signal.valid());
  EXPECT_DOUBLE_EQ(sources[1].constant, 3.0);
  const auto& config = dynamic_cast<const buses::can::CanWiring&>(*wiring->buses[0].bus).config();
  EXPECT_EQ(config.send[0].safe_values.at("Mode"), 1.0);
  EXPECT_EQ(config.send[0].protection.counter_signal, "Counter");
  EXPECT_EQ(config.receive[0].timeout_ns, 200'000'000);

  bool written = false;
  for (const signals::Source& source : wiring->buses[1].links.outputs)
    written = written || source.signal == id("collision.hits");
  EXPECT_TRUE(written);
}

TEST_F(WiringTest, RegisterIsWrittenFromAConstant) {
  const auto wiring = wired(changed("{detector: collision.hits}", "{detector: 12}"));
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  const auto& sources = wiring->buses[1].links.outputs;
  ASSERT_EQ(sources.size(), 1U);
  EXPECT_FALSE(sources[0].signal.valid());
  EXPECT_DOUBLE_EQ(sources[0].constant, 12.0);
}

/// The scenario with a bus of each type whose device needs no other program.
class DevicesOfEachBusType : public WiringTest {
 protected:
  DevicesOfEachBusType() {
    folder_.write("map.yaml",
                  "registers:\n"
                  "  - {name: detector, table: input, address: 0, type: u16, access: write}\n"
                  "  - {name: light, table: holding, address: 0, type: u16, access: read}\n");
    wiring_ = wired(changed("    device: 127.0.0.1:1502\n", "    device: 127.0.0.1:auto\n    role: server\n",
                            changed("    heartbeat: alive\n", "", changed("    read: [light]\n", ""))));
  }
  void SetUp() override {
    ASSERT_TRUE(wiring_) << diagnostics_.to_text();
    ASSERT_EQ(wiring_->buses.size(), buses::bus_types().size());
  }
  std::unique_ptr<buses::BusDevice> make_device(const WiredBus& bus,
                                                std::function<void()> on_thread_start = {}) const {
    return bus.bus->make_device({.scenario = *scenario_,
                                 .directory = folder_.path(),
                                 .on_thread_start = std::move(on_thread_start),
                                 .stop_requested = stop_requested_});
  }

  std::atomic<bool> stop_requested_{false};
  std::optional<Wiring> wiring_;
};

TEST_F(DevicesOfEachBusType, CallTheHookInTheirThread) {
  const io::RunningClock clock;
  for (const WiredBus& wired : wiring_->buses) {
    SCOPED_TRACE(wired.section->full_name());
    std::atomic<int> calls{0};
    std::atomic<bool> is_own_thread{false};
    const auto run = make_device(wired, [&, test = std::this_thread::get_id()] {
      is_own_thread = std::this_thread::get_id() != test;
      ++calls;
    });
    run->device().start(clock, io::Pacing::realtime);
    EXPECT_TRUE(tests::eventually([&] { return calls == 1; }));
    run->device().stop();
    EXPECT_EQ(calls, 1);
    EXPECT_TRUE(is_own_thread);
  }
}

TEST_F(DevicesOfEachBusType, RecordTheFieldsThatTheirTypeNames) {
  const io::RunningClock clock;
  for (const WiredBus& wired : wiring_->buses) {
    const buses::BusType& type = buses::type_of(*wired.section);
    SCOPED_TRACE(type.section.key);
    const auto run = make_device(wired);
    run->device().start(clock, io::Pacing::realtime);
    run->device().stop();
    const contribution::BusRecord record = run->record();
    EXPECT_FALSE(record.name.empty());
    for (const contribution::BusColumn& column : type.columns) {
      if (column.key == type.section.name_key) continue;
      EXPECT_NE(record.find(column.key), nullptr) << "no field for the column " << column.key;
    }
    EXPECT_EQ(record.dropped_releases.has_value(), type.section.counts_dropped_releases);
  }
}

TEST_F(WiringTest, LimitsOfAUnitAreInItsSettings) {
  const auto wiring = wired(changed("    heartbeat: alive\n",
                                    "    heartbeat: alive\n    unit_id: 250\n    max_gap: 9\n"
                                    "    max_clients: 7\n"));
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  const auto& section = dynamic_cast<const buses::modbus::ModbusSection&>(*wiring->buses[1].section);
  const io::modbus::ClientSettings client = buses::modbus::client_settings(section, {});
  EXPECT_EQ(client.unit, 250);
  EXPECT_EQ(client.max_gap, 9);
  EXPECT_EQ(buses::modbus::server_settings(section, {}).limits.max_connections, 7U);
}

TEST_F(WiringTest, SearchedLayersHaveAnotherBody) {
  const auto alone = [](const std::string& text) {
    return changed(
        "  entities: [{name: rock, shape: {sphere: 1 m}, position: [90 m, 0 m, 0 m], mask: [vehicle]}]\n", "",
        text);
  };
  EXPECT_TRUE(refuses(alone(scenario_text), "vehicle]}",
                      "module collision searches 'vehicle', where there is no other body, so it could never "
                      "find one"));
  const std::string with_pole =
      changed("  layers: [vehicle]\n",
              "  layers: [vehicle, pole]\n  entities:\n"
              "    - {name: pole, shape: {box: [1 m, 1 m, 1 m]}, position: [9 m, 0 m, 0 m], mask: [pole]}\n",
              alone(scenario_text));
  EXPECT_TRUE(wired(changed("against: [vehicle]", "against: [vehicle, pole]", with_pole)))
      << diagnostics_.to_text();
}

TEST_F(WiringTest, OpenInputHasNoSignal) {
  const auto wiring = wired(changed("      ego_brake_request: can.car.BrakeCommand.Deceleration\n", ""));
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_FALSE(wiring->modules[0].links.inputs[1].signal.valid());
}

TEST_F(WiringTest, UnknownSignalIsAMistakeWithTheNearestName) {
  const struct {
    const char *from, *to, *nearest;
  } cases[] = {{"light_east: modbus.plc.light", "light_east: modbus.plc.ligth", "'modbus.plc.light'"},
               {"Speed: traffic.ego.speed", "Speed: traffic.ego.sped", "'traffic.ego.speed'"},
               {"{detector: collision.hits}", "{detector: collision.hit}", "'collision.hits'"},
               {"request: can.car.EgoStatus.Counter", "request: can.car.EgoStatus.Count",
                "'can.car.EgoStatus.Counter'"},
               {"AnswerTo, within", "AnswrTo, within", "'can.car.BrakeCommand.AnswerTo'"},
               {"never: collision.total > 0", "never: collision.totl > 0", "'collision.total'"}};
  for (const auto& one : cases) {
    const std::string text = changed(one.from, one.to);
    const std::string to = one.to;
    std::string signal = to.substr(to.find(": ") == std::string::npos ? 0 : to.find(": ") + 2);
    signal = signal.substr(0, signal.find_first_of(", }>"));
    if (to.rfind("AnswrTo", 0) == 0) signal = "can.car.BrakeCommand.AnswrTo";
    EXPECT_TRUE(refuses(text, signal, "there is no signal '" + signal + "'")) << one.to;
    EXPECT_NE(diagnostics_.to_text().find(one.nearest), std::string::npos) << diagnostics_.to_text();
  }
}

TEST_F(WiringTest, SecondWriterOfASignalIsAMistake) {
  const std::string text =
      changed("  - module: collision\n",
              "  - module: modbus\n    type: detectors\n    rate: 50 Hz\n    parameters: {layers: [vehicle], "
              "loops: {x: {center: [0 m, 0 m, 0 m], size: [1 m, 1 m, 1 m]}}}\n  - module: collision\n");
  EXPECT_TRUE(wired(text)) << "modbus.x is not modbus.plc.x:\n" << diagnostics_.to_text();
  folder_.write("map.yaml", std::string(registers_text) +
                                "  - {name: speed, table: input, address: 1, type: u16, access: read}\n");
  const std::string clash =
      changed("  - module: collision\n",
              "  - module: modbus\n    type: vehicles\n    rate: 1 kHz\n    parameters: {vehicles: {plc: "
              "{position: [9 m, 9 m], speed: 1 m/s}}}\n  - module: collision\n",
              changed("read: [light]", "read: [light, speed]"));
  EXPECT_TRUE(refuses(clash, "plc\n    device",
                      "two writers of one signal: 'modbus.plc.speed' is written by "
                      "module modbus and by modbus.plc"));
}

TEST_F(WiringTest, SignalWithoutAUnitAcceptsAnyUnit) {
  EXPECT_TRUE(wired(changed("Mode: 3", "Mode: traffic.ego.speed"))) << diagnostics_.to_text();
}

TEST_F(WiringTest, WrongNamesAndUnitsAreMistakesAtTheirPlaces) {
  const struct {
    const char *from, *to, *at, *words;
    std::size_t mistakes = 1;
  } cases[] = {
      {"ego_brake_request:", "ego_brake_reqest:", "ego_brake_reqest",
       "module traffic has no input 'ego_brake_reqest'; did you mean 'ego_brake_request'?"},
      {"      light_east: modbus.plc.light\n", "", "traffic\n",
       "module traffic needs its input 'light_east'"},
      {"Speed: traffic.ego.speed", "Speed: traffic.ego.x", "traffic.ego.x",
       "'traffic.ego.x' is in m, but 'EgoStatus.Speed' is in m/s"},
      {"can.car.BrakeCommand.Deceleration\n", "can.car.BrakeCommand.Length\n", "can.car.BrakeCommand.Length",
       "is in m, but 'ego_brake_request' is in m/s2"},
      {"{Speed: traffic", "{Spede: traffic", "Spede",
       "message EgoStatus has no signal 'Spede'; did you mean '"},
      {"counter: Counter", "counter: Countre", "Countre", "has no signal 'Countre'; did you mean '", 2},
      {"checksum: Checksum", "checksum: Cheksum", "Cheksum", "has no signal 'Cheksum'; did you mean '", 2},
      {"safe: {Mode: 1}", "safe: {Mdoe: 1}", "Mdoe", "has no signal 'Mdoe'; did you mean '"},
      {"Mode: 3", "Mode: 16", "16}", "'Mode': 16 is out of range; the signal has the range 0 to 15"},
      {"Mode: 3", "Mode: -5", "-5}", "-5 is out of range"},
      {"Speed: traffic.ego.speed", "Speed: 1e300", "1e300", "has the range -100 to 100"},
      {"safe: {Mode: 1}", "safe: {Mode: 1e300}", "1e300", "has the range 0 to 15"},
      {"- message: EgoStatus", "- message: EgoStatsu", "EgoStatsu",
       "the CAN database has no message 'EgoStatsu'; did you mean 'EgoStatus'?"},
      {"{message: BrakeCommand,", "{message: BrakeComand,", "BrakeComand", "did you mean 'BrakeCommand'?"}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.to);
    const std::string text = changed(one.from, one.to);
    EXPECT_FALSE(wired(text));
    EXPECT_EQ(diagnostics_.count(), one.mistakes) << diagnostics_.to_text();
    EXPECT_TRUE(has_mistake(text, one.at, one.words));
  }
}

/// A part that can not be declared hides no mistakes elsewhere, and its signals are not reported as missing.
TEST_F(WiringTest, MistakesHideNoOthers) {
  const struct {
    const char *from, *to, *at, *words;
  } changes[] = {
      {"ego_brake_request:", "ego_brake_reqest:", "ego_brake_reqest", "has no input"},
      {"Mode: 3", "Mode: traffic.ego.sped", "traffic.ego.sped", "there is no signal"},
      {"{detector: collision.hits}", "{detector: collision.hit}", "collision.hit}", "there is no signal"},
      {"collision.total > 0", "collision.totl > 0", "collision.totl", "there is no signal"},
      {"{message: BrakeCommand,", "{message: BrakeComand,", "BrakeComand", "no message"},
      {"stop_line: 50 m, ", "", "east, braked", "no stop_line"},
      {"collision.total > 0", "collision.total > 0 or traffic.eog.x > 1", "traffic.eog.x",
       "there is no signal"}};
  // Each combination with its number of mistakes.
  const std::pair<std::vector<std::size_t>, std::size_t> combinations[] = {
      {{0, 1, 2, 6}, 4}, {{1, 4}, 2}, {{2, 3, 4, 5}, 4}};
  for (const auto& [chosen, mistakes] : combinations) {
    SCOPED_TRACE(mistakes);
    std::string text = scenario_text;
    for (const std::size_t i : chosen)
      text = changed(changes[i].from, changes[i].to, text);
    EXPECT_FALSE(wired(text));
    EXPECT_EQ(diagnostics_.count(), mistakes) << diagnostics_.to_text();
    for (const std::size_t i : chosen)
      EXPECT_TRUE(has_mistake(text, changes[i].at, changes[i].words));
  }
}

TEST_F(WiringTest, CrossingOfTheRepositoryIsWired) {
  auto loaded = config::load_scenario(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.yaml", {},
                                      scenario_types(), diagnostics_);
  ASSERT_TRUE(loaded) << diagnostics_.to_text();
  EXPECT_TRUE(wire(*loaded, diagnostics_)) << diagnostics_.to_text();
}

}  // namespace
}  // namespace hil::run
