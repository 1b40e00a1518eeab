// Who writes which signal and who reads it: every mistake with its place and the nearest name there is.

#include "runtime/run/wiring.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "runtime/buses/can/can_bus.hpp"
#include "runtime/buses/modbus/modbus_unit.hpp"
#include "tests/paths.h"
#include "tests/unit/runtime_run/run_test.hpp"

namespace hil::run {
namespace {

using testing::Folder;

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

class WiringOf : public ::testing::Test {
 protected:
  WiringOf() {
    folder_.write("test.dbc", database_text);
    folder_.write("map.yaml", registers_text);
  }

  std::optional<Wiring> wired(const std::string& text) {
    auto loaded =
        config::load_scenario(folder_.write("scenario.yaml", text), {}, scenario_types(), diagnostics_);
    if (!loaded) throw std::runtime_error("refused before the wiring:\n" + diagnostics_.to_text());
    scenario_ = std::make_unique<config::Scenario>(std::move(*loaded));
    return wire(*scenario_, diagnostics_);
  }

  static std::string changed(const std::string& from, const std::string& to,
                             std::string text = scenario_text) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos || text.find(from, at + 1) != std::string::npos)
      throw std::runtime_error("not exactly once in the text: " + from);
    return text.replace(at, from.size(), to);
  }

  /// Whether there is such a mistake, at the line and column where `at` begins in the text.
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
  /// The only mistake of the changed scenario.
  ::testing::AssertionResult refuses(const std::string& text, const std::string& at,
                                     const std::string& words) {
    if (wired(text)) return ::testing::AssertionFailure() << "not refused";
    if (diagnostics_.count() != 1)
      return ::testing::AssertionFailure() << "not exactly one mistake:\n" << diagnostics_.to_text();
    return has_mistake(text, at, words);
  }

  Folder folder_;
  config::Diagnostics diagnostics_;
  std::unique_ptr<config::Scenario> scenario_;
};

TEST_F(WiringOf, ABusIsRefusedWhenMoreMistakesWereMadeThanAreKept) {
  for (const auto& [good, bad] : {std::pair("checksum: Checksum", "checksum: Counter"),
                                  std::pair("safe: {Mode: 1}", "safe: {Moed: 1}")}) {
    config::Diagnostics diagnostics;
    const auto scenario = config::load_scenario(folder_.write("scenario.yaml", changed(good, bad)), {},
                                                scenario_types(), diagnostics);
    ASSERT_TRUE(scenario) << diagnostics.to_text();
    for (std::size_t i = 0; i < config::Diagnostics::capacity; ++i)
      diagnostics.add({}, "said before");
    EXPECT_FALSE(wire(*scenario, diagnostics)) << bad;
    EXPECT_GT(diagnostics.count(), config::Diagnostics::capacity) << bad;
  }
}

TEST_F(WiringOf, AGoodScenarioConnectsEverySignal) {
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
  ASSERT_EQ(traffic.inputs.size(), 2U);
  EXPECT_EQ(traffic.inputs[0], id("modbus.plc.light"));
  EXPECT_EQ(traffic.inputs[1], id("can.car.BrakeCommand.Deceleration"));
  EXPECT_EQ(traffic.outputs.size(), 5U);
  EXPECT_EQ(traffic.outputs[0], id("traffic.ego.x"));
  EXPECT_DOUBLE_EQ(table.value(id("traffic.ego.speed")), 10.0) << "signals start with their initial values";

  ASSERT_EQ(wiring->buses.size(), 2U);
  const auto& sources = wiring->buses[0].links.outputs;  // Speed, Mode
  ASSERT_EQ(sources.size(), 2U);
  EXPECT_EQ(sources[0].signal, id("traffic.ego.speed"));
  EXPECT_FALSE(sources[1].signal.valid());
  EXPECT_DOUBLE_EQ(sources[1].constant, 3.0);
  const auto& config = dynamic_cast<const buses::can::CanBus&>(*wiring->buses[0].bus).config();
  EXPECT_EQ(config.send[0].safe_values.at("Mode"), 1.0);
  EXPECT_EQ(config.send[0].protection.counter_signal, "Counter");
  EXPECT_EQ(config.receive[0].timeout_ns, 200'000'000);

  bool written = false;
  for (const buses::Source& source : wiring->buses[1].links.outputs)
    written = written || source.signal == id("collision.hits");
  EXPECT_TRUE(written);
}

TEST_F(WiringOf, ARegisterCanBeWrittenFromAConstant) {
  const auto wiring = wired(changed("{detector: collision.hits}", "{detector: 12}"));
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  const auto& sources = wiring->buses[1].links.outputs;
  ASSERT_EQ(sources.size(), 1U);
  EXPECT_FALSE(sources[0].signal.valid());
  EXPECT_DOUBLE_EQ(sources[0].constant, 12.0);
}

TEST_F(WiringOf, LimitsOfAUnitReachItsDevice) {
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

TEST_F(WiringOf, AnInputThatIsNotConnectedHasNoSignal) {
  const auto wiring = wired(changed("      ego_brake_request: can.car.BrakeCommand.Deceleration\n", ""));
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_FALSE(wiring->modules[0].links.inputs[1].valid());
}

TEST_F(WiringOf, AnUnknownSignalHasItsPlaceAndTheNearestName) {
  const struct {
    const char *from, *to, *nearest;
  } cases[] = {{"light_east: modbus.plc.light", "light_east: modbus.plc.ligth", "'modbus.plc.light'"},
               {"Speed: traffic.ego.speed", "Speed: traffic.ego.sped", "'traffic.ego.speed'"},
               {"{detector: collision.hits}", "{detector: collision.hit}", "'collision.hits'"},
               {"request: can.car.EgoStatus.Counter", "request: can.car.EgoStatus.Count", ""},
               {"AnswerTo, within", "AnswrTo, within", "'can.car.BrakeCommand.AnswerTo'"},
               {"never: collision.total > 0", "never: collision.totl > 0", "'collision.total'"}};
  for (const auto& one : cases) {
    diagnostics_ = {};
    const std::string text = changed(one.from, one.to);
    const std::string to = one.to;
    std::string signal = to.substr(to.find(": ") == std::string::npos ? 0 : to.find(": ") + 2);
    signal = signal.substr(0, signal.find_first_of(", }>"));
    if (to.rfind("AnswrTo", 0) == 0) signal = "can.car.BrakeCommand.AnswrTo";
    EXPECT_TRUE(refuses(text, signal, "there is no signal '" + signal + "'")) << one.to;
    EXPECT_NE(diagnostics_.to_text().find(one.nearest), std::string::npos) << diagnostics_.to_text();
  }
}

TEST_F(WiringOf, AnInputThatTheModuleDoesNotHaveIsAMistake) {
  const std::string text = changed("ego_brake_request:", "ego_brake_reqest:");
  EXPECT_TRUE(refuses(text, "ego_brake_reqest",
                      "module traffic has no input 'ego_brake_reqest'; did you mean "
                      "'ego_brake_request'?"));
}

TEST_F(WiringOf, ARequiredInputHasToBeConnected) {
  const std::string text = changed("      light_east: modbus.plc.light\n", "");
  EXPECT_TRUE(refuses(text, "traffic\n", "module traffic needs its input 'light_east'"));
}

TEST_F(WiringOf, TwoWritersOfOneSignalAreAMistake) {
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
  diagnostics_ = {};
  EXPECT_TRUE(refuses(clash, "plc\n    device",
                      "two writers of one signal: 'modbus.plc.speed' is written by "
                      "module modbus and by modbus.plc"));
}

TEST_F(WiringOf, UnitsHaveToAgree) {
  const std::string text = changed("Speed: traffic.ego.speed", "Speed: traffic.ego.x");
  EXPECT_TRUE(refuses(text, "traffic.ego.x", "'traffic.ego.x' is in m, but 'EgoStatus.Speed' is in m/s"));
}

TEST_F(WiringOf, UnitsOfAModulesInputsHaveToAgreeToo) {
  const std::string text = changed("can.car.BrakeCommand.Deceleration\n", "can.car.BrakeCommand.Length\n");
  EXPECT_TRUE(refuses(text, "can.car.BrakeCommand.Length", "is in m, but 'ego_brake_request' is in m/s2"));
}

TEST_F(WiringOf, UnitsThatAreLeftOpenFitAnything) {
  EXPECT_TRUE(wired(changed("Mode: 3", "Mode: traffic.ego.speed"))) << diagnostics_.to_text();
}

TEST_F(WiringOf, AnUnknownMessageHasTheNearestName) {
  const std::string sent = changed("- message: EgoStatus", "- message: EgoStatsu");
  ASSERT_FALSE(wired(sent));
  EXPECT_TRUE(has_mistake(sent, "EgoStatsu",
                          "the CAN database has no message 'EgoStatsu'; did you mean 'EgoStatus'?"));
  diagnostics_ = {};
  const std::string received = changed("{message: BrakeCommand,", "{message: BrakeComand,");
  ASSERT_FALSE(wired(received));
  EXPECT_TRUE(has_mistake(received, "BrakeComand", "did you mean 'BrakeCommand'?"));
}

TEST_F(WiringOf, AnUnknownSignalOfAMessageHasTheNearestName) {
  const struct {
    const char *from, *to, *at;
  } cases[] = {{"{Speed: traffic", "{Spede: traffic", "Spede"},
               {"counter: Counter", "counter: Countre", "Countre"},
               {"checksum: Checksum", "checksum: Cheksum", "Cheksum"},
               {"safe: {Mode: 1}", "safe: {Mdoe: 1}", "Mdoe"}};
  for (const auto& one : cases) {
    diagnostics_ = {};
    const std::string text = changed(one.from, one.to);
    ASSERT_FALSE(wired(text)) << one.to;
    EXPECT_TRUE(has_mistake(text, one.at,
                            std::string("message EgoStatus has no signal '") + one.at + "'; did you mean '"))
        << one.to;
  }
}

TEST_F(WiringOf, AConstantThatItsSignalDoesNotHoldIsAMistake) {
  const struct {
    const char *from, *to, *at, *words;
  } cases[] = {
      {"Mode: 3", "Mode: 16", "Mode: 16", "'Mode': 16 is out of range; the signal has the range 0 to 15"},
      {"Mode: 3", "Mode: -5", "Mode: -5", "-5 is out of range"},
      {"Speed: traffic.ego.speed", "Speed: 1e300", "Speed: 1e300", "has the range -100 to 100"},
      {"safe: {Mode: 1}", "safe: {Mode: 1e300}", "Mode: 1e300", "has the range 0 to 15"}};
  for (const auto& one : cases) {
    diagnostics_ = {};
    EXPECT_TRUE(refuses(changed(one.from, one.to), one.at, one.words)) << one.to;
  }
}

/// Refused before the wiring, which may then count on it.
TEST_F(WiringOf, WhatADeviceFillsItselfIsNotFedBySignals) {
  const struct {
    const char *from, *to, *at;
  } cases[] = {{"Mode: 3}", "Mode: 3, Checksum: 5}", "Checksum: 5"},
               {"Mode: 3}", "Mode: 3, Counter: traffic.ego.x}", "Counter: traffic"},
               {"{detector: collision.hits}", "{detector: collision.hits, alive: collision.hits}",
                "alive: collision"}};
  for (const auto& one : cases) {
    diagnostics_ = {};
    const std::string text = changed(one.from, one.to);
    EXPECT_FALSE(
        config::load_scenario(folder_.write("scenario.yaml", text), {}, scenario_types(), diagnostics_));
    EXPECT_EQ(diagnostics_.count(), 1U) << diagnostics_.to_text();
    EXPECT_TRUE(has_mistake(text, one.at, "hil sets"));
  }
}

TEST_F(WiringOf, AllMistakesAreReportedAtOnce) {
  std::string text = scenario_text;
  text = changed("ego_brake_request:", "ego_brake_reqest:", text);
  text = changed("Mode: 3", "Mode: traffic.ego.sped", text);
  text = changed("{detector: collision.hits}", "{detector: collision.hit}", text);
  text = changed("never: collision.total > 0", "never: collision.totl > 0 or traffic.eog.x > 1", text);
  EXPECT_FALSE(wired(text));
  EXPECT_EQ(diagnostics_.count(), 5U) << diagnostics_.to_text();
  EXPECT_TRUE(has_mistake(text, "ego_brake_reqest", "has no input"));
  EXPECT_TRUE(has_mistake(text, "traffic.ego.sped", "there is no signal"));
  EXPECT_TRUE(has_mistake(text, "collision.hit}", "there is no signal"));
  EXPECT_TRUE(has_mistake(text, "collision.totl", "there is no signal"));
  EXPECT_TRUE(has_mistake(text, "traffic.eog.x", "there is no signal"));
}

/// A part that can not be declared does not hide mistakes elsewhere, and its own signals are not blamed on
/// those that ask for them.
TEST_F(WiringOf, AMistakeInOnePartDoesNotHideThoseOfOthers) {
  std::string text = scenario_text;
  text = changed("{message: BrakeCommand,", "{message: BrakeComand,", text);
  text = changed("stop_line: 50 m, ", "", text);
  text = changed("never: collision.total > 0", "never: collision.totl > 0", text);
  text = changed("{detector: collision.hits}", "{detector: collision.hit}", text);
  EXPECT_FALSE(wired(text));
  EXPECT_EQ(diagnostics_.count(), 4U) << diagnostics_.to_text();
  EXPECT_TRUE(has_mistake(text, "BrakeComand", "no message"));
  EXPECT_TRUE(has_mistake(text, "east, braked", "no stop_line"));
  EXPECT_TRUE(has_mistake(text, "collision.totl", "there is no signal"));
  EXPECT_TRUE(has_mistake(text, "collision.hit}", "there is no signal"));
}

TEST_F(WiringOf, AMistakeInOneMessageDoesNotHideThoseOfTheSameBus) {
  std::string text = scenario_text;
  text = changed("{message: BrakeCommand,", "{message: BrakeComand,", text);
  text = changed("Mode: 3", "Mode: traffic.ego.sped", text);
  EXPECT_FALSE(wired(text));
  EXPECT_EQ(diagnostics_.count(), 2U) << diagnostics_.to_text();
  EXPECT_TRUE(has_mistake(text, "BrakeComand", "no message"));
  EXPECT_TRUE(has_mistake(text, "traffic.ego.sped", "there is no signal"));
}

TEST_F(WiringOf, TheCrossingOfTheRepositoryIsWired) {
  auto loaded = config::load_scenario(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.yaml", {},
                                      scenario_types(), diagnostics_);
  ASSERT_TRUE(loaded) << diagnostics_.to_text();
  EXPECT_TRUE(wire(*loaded, diagnostics_)) << diagnostics_.to_text();
}

}  // namespace
}  // namespace hil::run
