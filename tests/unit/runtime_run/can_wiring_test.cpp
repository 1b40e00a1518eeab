// CAN sections with their DBC files: defaults of the file, value names, long names, and unusable messages.

#include "runtime/buses/can/can_wiring.hpp"

#include <gtest/gtest.h>

#include "io/can/dbc.hpp"
#include "runtime/expectations/kinds.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/text_mutator.hpp"
#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::run {
namespace {

const std::string database = R"(VERSION ""
BU_: HIL ECU
BO_ 256 Command: 8 HIL
 SG_ KeyState : 0|4@1+ (1,0) [0|2] "" ECU
 SG_ Torque : 8|8@1+ (0.5,-20) [-20|100] "" ECU
 SG_ Level : 16|8@1+ (1,0) [0|255] "" ECU
BO_ 768 Status: 8 ECU
 SG_ Mode : 0|4@1+ (2,10) [0|0] "" HIL
 SG_ BatteryCellOverVoltageWarn_0001 : 8|8@1+ (1,0) [0|255] "" HIL
 SG_ Total : 16|32@1+ (1,0) [0|0] "" HIL
BO_ 769 Wide: 8 ECU
 SG_ Big : 0|64@1+ (1,0) [0|0] "" HIL
BO_ 772 Plain: 8 ECU
 SG_ Level : 0|8@1+ (1,0) [0|255] "" HIL
BO_ 770 WideCommand: 8 HIL
 SG_ Big : 0|64@1+ (1,0) [0|0] "" ECU
BO_ 4096 Unmarked: 8 ECU
 SG_ S : 0|8@1+ (1,0) [0|0] "" HIL
BO_ 771 Crossed: 8 HIL
 SG_ One : 0|9@1+ (1,0) [0|0] "" ECU
 SG_ Two : 8|8@1+ (1,0) [0|0] "" ECU
BA_ "GenMsgCycleTime" BO_ 256 20;
BA_ "GenMsgCycleTime" BO_ 768 40;
BA_ "GenSigStartValue" SG_ 256 Torque 255;
BA_ "GenSigStartValue" SG_ 256 Level 7;
BA_ "SystemSignalLongSymbol" SG_ 768 BatteryCellOverVoltageWarn_0001 "BatteryCellOverVoltageWarningIndexFront";
BA_ "SystemMessageLongSymbol" BO_ 768 "StatusOfTheBatteryManagement";
VAL_ 256 KeyState 0 "Off" 1 "On" 2 "Crank Start" 15 "SNA" 3 "twice" 4 "twice" ;
VAL_ 256 Torque 255 "SNA" ;
VAL_ 768 Mode 1 "Normal" 2 "LimpHome" 3 "limp home" ;
)";

const std::string scenario = R"(scenario: names
base_rate: 1 kHz
duration: 1 s
can:
  - bus: car
    device: virtual
    database: test.dbc
    rate: 100 Hz
    send:
      - message: Command
        signals: {KeyState: On}
    receive:
      - message: Status
expectations:
  - {name: it limps, eventually: can.car.Status.Mode == LimpHome}
)";

class CanWiring : public test::WiringFixture {
 protected:
  CanWiring() { folder_.write("test.dbc", database); }

  static std::string changed(const std::string& from, const std::string& to,
                             const std::string& text = scenario) {
    return WiringFixture::changed(from, to, text);
  }
  /// Whether the only mistake contains `words` and has this line of the scenario.
  ::testing::AssertionResult refuses(const std::string& text, std::uint32_t line, const std::string& words) {
    if (wired(text)) return ::testing::AssertionFailure() << "not refused";
    if (diagnostics_.count() != 1 || diagnostics_.mistakes()[0].place.line != line ||
        diagnostics_.mistakes()[0].message.find(words) == std::string::npos)
      return ::testing::AssertionFailure() << "not '" << words << "' in line " << line << ":\n"
                                           << diagnostics_.to_text();
    return ::testing::AssertionSuccess();
  }
  /// Whether the scenario is wired, and its only warning contains `words`.
  ::testing::AssertionResult warns(const std::string& text, const std::string& words) {
    if (!wired(text) || diagnostics_.warning_count() != 1 ||
        diagnostics_.warnings()[0].message.find(words) == std::string::npos)
      return ::testing::AssertionFailure() << "no warning '" << words << "':\n" << diagnostics_.to_text();
    return ::testing::AssertionSuccess();
  }
  static const io::can::CanDeviceConfig& config_of(const Wiring& wiring) {
    return dynamic_cast<const buses::can::CanWiring&>(*wiring.buses.at(0).bus).config();
  }
  /// The constant of an output of `Command`: KeyState, Torque, Level.
  double constant(const Wiring& wiring, std::size_t output) {
    return wiring.buses.at(0).links.outputs.at(output).constant;
  }
};

TEST_F(CanWiring, DatabaseProvidesPeriodsTimeOutsAndStartValues) {
  const auto wiring = wired(scenario);
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(diagnostics_.warning_count(), 0U) << diagnostics_.to_text();
  const io::can::CanDeviceConfig& device = config_of(*wiring);
  EXPECT_EQ(device.send.at(0).period_ns, 20'000'000);
  EXPECT_EQ(device.receive.at(0).timeout_ns, 3 * 40'000'000);
  EXPECT_EQ(constant(*wiring, 0), 1.0) << "On";
  EXPECT_EQ(constant(*wiring, 1), 255 * 0.5 - 20) << "the start value is raw";
  EXPECT_EQ(constant(*wiring, 2), 7.0);
}

TEST_F(CanWiring, ScenarioPrecedesTheDatabase) {
  std::string text = changed("- message: Command\n", "- message: Command\n        period: 50 ms\n");
  text = changed("- message: Status\n", "- {message: Status, timeout: 0 ms}\n", text);
  text = changed("{KeyState: On}", "{KeyState: 2, Torque: 30, Level: 9}", text);
  const auto wiring = wired(text);
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(config_of(*wiring).send.at(0).period_ns, 50'000'000);
  EXPECT_EQ(config_of(*wiring).receive.at(0).timeout_ns, 0) << "never";
  EXPECT_EQ(constant(*wiring, 1), 30.0);
  EXPECT_EQ(constant(*wiring, 2), 9.0);
}

TEST_F(CanWiring, CycleTimeThatTheBusCanNotKeepIsRefused) {
  EXPECT_TRUE(
      refuses(changed("rate: 100 Hz", "rate: 40 Hz"), 10, "is no multiple of the bus's period of 25 ms"));
  EXPECT_TRUE(refuses(changed("- message: Command\n", "- message: Command\n        offset: 20 ms\n"), 11,
                      "has to be less than the message's period of 20 ms"));
}

TEST_F(CanWiring, UnusableStartValuesAreWarnings) {
  const std::string unset = changed("{KeyState: On}", "{Level: 3}");
  EXPECT_TRUE(warns(unset, "their safe values: 'KeyState'"));
  EXPECT_EQ(diagnostics_.warnings()[0].place.line, 10U);
  folder_.write("test.dbc", database + "BA_DEF_DEF_ \"GenSigStartValue\" 0;\n");
  EXPECT_TRUE(warns(unset, "(BA_DEF_DEF_ GenSigStartValue): 'KeyState' (0)"));
  folder_.write("test.dbc", changed("SG_ 256 Level 7", "SG_ 256 Level 9999", database));
  EXPECT_TRUE(warns(scenario, "do not fit their bits; they have their safe values: 'Level' (9999)"));
}

TEST_F(CanWiring, MessageThatIsSentAndReceivedIsRefused) {
  EXPECT_TRUE(refuses(changed("- message: Status\n", "- message: Status\n      - message: Command\n"), 14,
                      "message 'Command' is under 'receive' and under 'send'"));
}

TEST_F(CanWiring, DuplicateMessagesAndUnusableChecksumsAreRefused) {
  const std::string both = "- message: Status\n      - message: StatusOfTheBatteryManagement\n";
  EXPECT_TRUE(refuses(changed("- message: Status\n", both), 14,
                      "message 'StatusOfTheBatteryManagement' is named twice"));
  EXPECT_TRUE(refuses(changed("- message: Status\n", "- {message: Status, checksum: Mode}\n"), 13,
                      "not multiplexed integer of 8 bits"));
}

TEST_F(CanWiring, StatementsAboutUnknownMessagesAndSignalsAreWarnings) {
  const std::string no_message = "no message has the identifier 777";
  const std::string no_signal = "has no signal 'Modee'";
  const std::pair<const char*, std::string> statements[] = {
      {"VAL_ 777 Mode 0 \"a\" ;", no_message},
      {"VAL_ 768 Modee 0 \"a\" ;", no_signal},
      {"SIG_VALTYPE_ 768 Modee : 1;", no_signal},
      {"SG_MUL_VAL_ 768 Mode Modee 1-2;", no_signal},
      {"BA_ \"GenSigStartValue\" SG_ 777 Mode 1;", no_message},
      {"BA_ \"GenMsgCycleTime\" BO_ 777 10;", no_message}};
  for (const auto& [statement, words] : statements) {
    folder_.write("test.dbc", database + statement + "\n");
    EXPECT_TRUE(warns(scenario, words)) << statement;
  }
}

TEST_F(CanWiring, ExpectationOverASignalWithoutATimeOutIsAWarning) {
  const auto expecting = [&](const std::string& claim, const std::string& received) {
    const std::string text = changed("- message: Status\n", "- message: Status\n      " + received);
    return changed("eventually: can.car.Status.Mode == LimpHome", claim, text);
  };
  for (const char* claim : {"never: can.car.Plain.Level > 9", "always: can.car.Plain.Level < 9"}) {
    EXPECT_TRUE(warns(expecting(claim, "- message: Plain\n"), "'can.car.Plain.Level' has no time-out"))
        << claim;
    for (const char* timeout : {"0 ms", "50 ms"}) {
      ASSERT_TRUE(wired(expecting(claim, std::string("- {message: Plain, timeout: ") + timeout + "}\n")));
      EXPECT_EQ(diagnostics_.warning_count(), 0U) << diagnostics_.to_text();
    }
  }
  ASSERT_TRUE(wired(expecting("eventually: can.car.Plain.Level > 9", "- message: Plain\n")));
  EXPECT_EQ(diagnostics_.warning_count(), 0U) << "one tick is enough: " << diagnostics_.to_text();
}

TEST_F(CanWiring, ValueNamesReplaceNumbers) {
  std::string text =
      changed("{KeyState: On}", "{KeyState: Crank Start, Torque: SNA}\n        safe: {KeyState: 'Off'}");
  text = changed("- message: Status\n", "- {message: Status, safe: {Mode: LimpHome}}\n", text);
  const auto wiring = wired(text);
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(constant(*wiring, 0), 2.0);
  EXPECT_EQ(constant(*wiring, 1), 255 * 0.5 - 20) << "out of range, but named";
  EXPECT_EQ(config_of(*wiring).send[0].safe_values.at("KeyState"), 0.0);
  EXPECT_EQ(config_of(*wiring).receive[0].safe_values.at("Mode"), 14.0) << "names are of raw values";
}

TEST_F(CanWiring, MessagesSendVariables) {
  const auto wiring =
      wired(changed("signals: {KeyState: On}", "signals: {KeyState: On, Level: level}", scenario) +
            "variables: {level: 12, On: 9}\n");
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(constant(*wiring, 0), 1.0) << "the value name, not the variable";
  EXPECT_EQ(wiring->buses[0].links.outputs[2].signal, *wiring->signals.find("level"));
}

TEST_F(CanWiring, ValueNamesInConditionsAreEvaluated) {
  for (const char* name : {"LimpHome", "'LimpHome'"}) {
    const auto wiring = wired(changed("Mode == LimpHome", std::string("Mode == ") + name));
    ASSERT_TRUE(wiring) << diagnostics_.to_text();
    signals::SignalTable table = wiring->signals;
    const expectations::Arrivals arrivals{};
    const auto judge = expectations::make_judge({.expectation = scenario_->expectations.at(0),
                                                 .table = table,
                                                 .arrivals = arrivals,
                                                 .duration_ticks = 10,
                                                 .options = {.period_ns = 1000000, .seed = 0}});
    const auto mode = table.find("can.car.Status.Mode");
    ASSERT_TRUE(mode);
    table.write(*mode, 12.0, 0);
    judge->check(table, {.time_ns = 0});
    EXPECT_NE(judge->result({1, 1, 1'000'000}).result, report::ExpectationResult::held);
    table.write(*mode, 14.0, 1'000'000);
    judge->check(table, {.time_ns = 1'000'000});
    EXPECT_EQ(judge->result({2'000'000, 2, 1'000'000}).result, report::ExpectationResult::held);
  }
  EXPECT_TRUE(wired(changed("can.car.Status.Mode == LimpHome", "\"'limp home' != can.car.Status.Mode\"")))
      << diagnostics_.to_text();
}

constexpr const char* block_on_the_bus = R"(tasks:
  - module: limiter
    type: block
    rate: 100 Hz
    inputs: {mode: can.car.Status.Mode}
    parameters: {inputs: {mode: '1'}, outputs: {limp: mode == LimpHome, homes: mode == 'limp home'}}
  - module: lamp
    type: block
    rate: 100 Hz
    inputs: {mode: blinker.state, other: limiter.limp}
    parameters: {inputs: {mode: '1', other: '1'}, outputs: {on: mode == bright and other == 1}}
)";
constexpr const char* blinker = R"(  - module: blinker
    type: block
    rate: 100 Hz
    parameters:
      state_machines:
        state: {states: {dark: {transitions: [{to: bright, after: 1 s}]}, bright: {}}}
)";

TEST_F(CanWiring, ValueNamesAreKnownInsideBlocks) {
  const std::string tasks = "tasks:\n" + std::string(blinker) + std::string(block_on_the_bus).substr(7);
  EXPECT_TRUE(wired(changed("expectations:", tasks + "expectations:"))) << diagnostics_.to_text();
  const std::string later = block_on_the_bus + std::string(blinker);
  EXPECT_FALSE(wired(changed("expectations:", later + "expectations:")));
  EXPECT_NE(diagnostics_.to_text().find("'bright' is no number"), std::string::npos)
      << "names of a later module are not known: " << diagnostics_.to_text();
}

TEST_F(CanWiring, ValueNamesInsideBlocksAreRefusedWithTheNearest) {
  const std::string tasks = "tasks:\n" + std::string(blinker) + std::string(block_on_the_bus).substr(7);
  const std::string wrong = WiringFixture::changed("mode == LimpHome", "mode == LimpHme", tasks);
  EXPECT_FALSE(wired(changed("expectations:", wrong + "expectations:")));
  EXPECT_NE(diagnostics_.to_text().find("did you mean 'LimpHome'?"), std::string::npos)
      << diagnostics_.to_text();
  EXPECT_EQ(diagnostics_.count(), 1U) << diagnostics_.to_text();
  // A bus that can not be used adds no mistakes in the block.
  folder_.write("test.dbc", "no database\n");
  EXPECT_FALSE(wired(changed("expectations:", tasks + "expectations:")));
  EXPECT_EQ(diagnostics_.to_text().find("LimpHome"), std::string::npos) << diagnostics_.to_text();
}

TEST_F(CanWiring, UnknownValueNamesAreRefusedWithTheNearest) {
  EXPECT_TRUE(refuses(changed("KeyState: On", "KeyState: Onn"), 11, "did you mean 'On'?"));
  EXPECT_TRUE(
      refuses(changed("KeyState: On", "KeyState: twice"), 11, "several values with the name 'twice'"));
  EXPECT_TRUE(refuses(changed("KeyState: On", "Level: On"), 11, "'Command.Level' has no value names"));
  EXPECT_TRUE(refuses(changed("KeyState: On", "KeyState: traffic.ego.on"), 11, "there is no signal"));
  EXPECT_TRUE(refuses(changed("- message: Status\n", "- {message: Status, safe: {Mode: Limphome}}\n"), 13,
                      "did you mean 'LimpHome'?"));
  EXPECT_TRUE(refuses(changed("== LimpHome", "== LimpHme"), 15, "did you mean 'LimpHome'?"));
  EXPECT_TRUE(
      refuses(changed("Status.Mode == LimpHome", "Status.Total == LimpHome"), 15, "has no value names"));
}

TEST_F(CanWiring, UnitsOfTheScenarioReplaceThoseOfTheDatabase) {
  const auto with = [&](const std::string& units) {
    return changed("    send:\n", "    units: " + units + "\n    send:\n");
  };
  const auto wiring = wired(with("{Command: {Torque: N m, Level: '%'}, Status: {Total: km/h}}"));
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(wiring->signals.info(*wiring->signals.find("can.car.Status.Total")).unit, "km/h");
  EXPECT_EQ(wiring->signals.info(*wiring->signals.find("can.car.Status.Mode")).unit, "");
  const auto& outputs = wiring->buses.at(0).bus->channels().outputs();
  EXPECT_EQ(outputs[1].unit, "N m");
  EXPECT_EQ(outputs[2].unit, "%");
  EXPECT_TRUE(wired(changed("Mode == LimpHome", "Total > 3 m/s", with("{Status: {Total: km/h}}"))))
      << diagnostics_.to_text();
  EXPECT_TRUE(refuses(with("{Comand: {Torque: N m}}"), 9, "no message 'Comand'; did you mean 'Command'?"));
  EXPECT_TRUE(refuses(with("{Command: {Torque: furlongs}}"), 9, "'furlongs' is not a known unit"));
  EXPECT_TRUE(refuses(with("{Command: {Tork: N m}}"), 9, "message Command has no signal 'Tork'"));
}

TEST_F(CanWiring, LongAndShortNamesAreOneSignal) {
  const std::string signal = "BatteryCellOverVoltageWarn_0001";
  const std::string full = "can.car.StatusOfTheBatteryManagement.BatteryCellOverVoltageWarningIndexFront";
  for (const std::string& name :
       {full, "can.car.Status." + signal, "can.car.StatusOfTheBatteryManagement." + signal,
        std::string("can.car.Status.BatteryCellOverVoltageWarningIndexFront")}) {
    const auto wiring = wired(changed("can.car.Status.Mode == LimpHome", name + " == 1"));
    ASSERT_TRUE(wiring) << diagnostics_.to_text();
    EXPECT_EQ(wiring->signals.info(*wiring->signals.find(name)).name, full);
  }
  EXPECT_TRUE(refuses(changed("can.car.Status.Mode == LimpHome", full + "s == 1"), 15,
                      "did you mean '" + full + "'?"));
  const auto wiring =
      wired(changed("- message: Status\n", "- {message: Status, safe: {" + signal + ": 3}}\n"));
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(config_of(*wiring).receive[0].message, "StatusOfTheBatteryManagement");
  EXPECT_EQ(config_of(*wiring).receive[0].safe_values.at("BatteryCellOverVoltageWarningIndexFront"), 3.0);
}

TEST_F(CanWiring, MessagesThatNoFrameCanCarryAreRefusedWhereTheyAreUsed) {
  EXPECT_TRUE(
      refuses(changed("- message: Status\n", "- message: Status\n      - message: Unmarked\n"), 14,
              "message 'Unmarked' can not be used: identifier 4096 needs more than 11 bits, and bit 31, "
              "which marks a 29-bit identifier, is not set"));
  EXPECT_TRUE(refuses(changed("- message: Command\n", "- message: Crossed\n      - message: Command\n"), 10,
                      "these of its signals overlap: 'One' and 'Two'"));
}

TEST_F(CanWiring, IntegersBeyondADoubleAreWarningsWhereTheyAreUsed) {
  std::string text = changed("- message: Status\n", "- message: Status\n      - message: Wide\n");
  ASSERT_TRUE(wired(text)) << diagnostics_.to_text();
  EXPECT_EQ(diagnostics_.warning_count(), 0U) << "nothing reads it: " << diagnostics_.to_text();
  text = changed("can.car.Status.Mode == LimpHome", "can.car.Wide.Big > 1", text);
  text = changed(
      "      - message: Command\n",
      "      - message: WideCommand\n        signals: {Big: can.car.Wide.Big}\n      - message: Command\n",
      text);
  ASSERT_TRUE(wired(text)) << diagnostics_.to_text();
  ASSERT_EQ(diagnostics_.warning_count(), 3U) << diagnostics_.to_text();
  EXPECT_NE(diagnostics_.warnings()[0].message.find("has 64 bits; a signal is a double"), std::string::npos);
  EXPECT_EQ(diagnostics_.warnings()[0].place.line, 11U);
}

TEST_F(CanWiring, UnreadableStatementsAreWarningsWithTheirPlace) {
  folder_.write(
      "test.dbc",
      database + "CM_ \"unfinished\"\nBO_ 800 Broken: eight HIL\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n");
  ASSERT_TRUE(wired(scenario)) << diagnostics_.to_text();
  ASSERT_EQ(diagnostics_.warning_count(), 2U) << diagnostics_.to_text();
  const auto lines = static_cast<std::uint32_t>(std::count(database.begin(), database.end(), '\n'));
  EXPECT_EQ(diagnostics_.warnings()[0].place.line, lines + 1);
  EXPECT_EQ(diagnostics_.warnings()[1].place.line, lines + 2);
  EXPECT_NE(diagnostics_.warnings()[0].place.file.find("test.dbc"), std::string::npos);
}

TEST_F(CanWiring, FileWithoutAMessageIsRefusedWithItsPlace) {
  folder_.write("test.dbc", "\n  VERSION \"\"\n");
  ASSERT_FALSE(wired(scenario));
  EXPECT_EQ(diagnostics_.mistakes().at(0).place.line, 2U);
  EXPECT_EQ(diagnostics_.mistakes().at(0).place.column, 3U);
  EXPECT_NE(diagnostics_.mistakes().at(0).message.find("gives no message"), std::string::npos);
}

/// A scenario with a damaged file is wired, or refused with places.
TEST_F(CanWiring, DamagedDatabasesAreWiredOrRefused) {
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;
  const std::string text = changed("- message: Status\n", "- message: Status\n      - message: Wide\n");
  const std::uint64_t rounds = tests::rounds(2000);
  for (std::uint64_t seed = 0; seed < rounds; ++seed) {
    folder_.write("test.dbc", tests::TextMutator(seed).mutate(database));
    const bool is_wired = wired(text).has_value();
    ASSERT_EQ(is_wired, diagnostics_.empty()) << "seed " << seed;
    for (const config::Mistake& mistake : diagnostics_.mistakes())
      ASSERT_GE(mistake.place.line, 1U) << "seed " << seed << ": " << mistake.message;
    ++(is_wired ? accepted : refused);
  }
  EXPECT_GT(accepted, rounds / 10);
  EXPECT_GT(refused, rounds / 10);
}

}  // namespace
}  // namespace hil::run
