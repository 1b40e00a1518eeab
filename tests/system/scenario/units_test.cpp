// Runs whose claims depend on what units mean: temperatures and their differences, turns, numbers in units,
// and signals without a unit.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

std::string result_of(const nlohmann::json& report, const std::string& name) {
  for (const auto& expectation : report["expectations"])
    if (expectation["name"] == name) return expectation["result"];
  return "none";
}

constexpr const char* temperatures = R"(
scenario: temperatures
base_rate: 100 Hz
duration: 2 s
clock: virtual
variables: {above: p.hot - p.cold, apart: abs(p.hot - p.cold)}
tasks:
  - module: p
    type: block
    rate: 100 Hz
    parameters:
      inputs: {u: {unit: degC, initial: 20 degC}, swing: {unit: degF, initial: 50 degF}}
      outputs:
        hot: {value: 120 degC, unit: degC}
        cold: {value: 20 degC + 0 K, unit: UNIT}
        wave: {value: 20 degC + 50 K * sin(time * 10 rad/s), unit: UNIT}
        delta: {value: 120 degC - 20 degC, unit: K}
        driven: {value: u, unit: degC}
        swinging: {value: swing, unit: degC}
stimuli:
  - {name: wave, drives: p.swing, sequence: [{sine: {mean: 50 degF, amplitude: 9 degF, period: 1 s}, for: 2 s}]}
faults:
  - {name: shifted, signal: p.hot, offset: 5 degC, readers: [q]}
test_tables: [{name: table, file: table.csv}]
expectations:
  - {name: tracks, tracks: {signal: p.hot, reference: level.csv, tolerance: 5 degC}}
  - {name: quiet, statistics: {signal: p.wave, standard_deviation: {max: 2 degC}}}
  - {name: above a limit, always: p.hot < p.cold + 5 degC}
  - {name: below a difference, always: p.hot - p.cold < 9 degF}
  - {name: variable, always: above < 5 degC}
  - {name: function, always: apart < 5 degC}
  - {name: output, always: p.delta < 5 degC}
  - {name: limit of a difference, statistics: {signal: p.delta, largest: {max: 5 degC}}}
  - {name: at K, always: p.hot - p.cold < 5 K}
  - {name: holds, always: p.hot < p.cold + 101 degC and above < 181 degF and p.delta < 101 degC}
  - {name: swings, statistics: {signal: p.swinging, largest: {min: 14.9 degC, max: 15.1 degC}}}
  - {name: offset, always: q.seen > 124.9 degC and q.seen < 125.1 degC}
)";
constexpr const char* reader = R"(
tasks:
  - {module: q, type: block, rate: 100 Hz, inputs: {t: p.hot}, parameters: {inputs: {t: degC}, outputs: {seen: t}}}
)";

TEST(Units, ClaimsAboutTemperaturesFailWhereTheyAreFalse) {
  for (const std::string unit : {"degC", "degF"}) {
    std::string text = temperatures;
    for (std::size_t at; (at = text.find("UNIT")) != std::string::npos;)
      text.replace(at, 4, unit);
    text.insert(text.find("stimuli:"), std::string(reader).substr(std::string(reader).find("  - ")));
    const ScenarioFolder files(text);
    write_text(files.folder / "level.csv", "time,level\n0,20\n4,20\n");
    write_text(files.folder / "table.csv",
               "time,signal,value,fault,expectation,tolerance\n1,p.hot,,,20,5 degC\n");
    const Ended ended = files.run("out");
    ASSERT_EQ(ended.code, 1) << ended.output << ended.errors;
    const auto report = read_report(files.folder / "out");
    for (const char* claim : {"tracks", "quiet", "above a limit", "below a difference", "variable",
                              "function", "output", "limit of a difference", "at K", "table: p.hot"})
      EXPECT_EQ(result_of(report, claim), "failed") << claim << " " << unit;
    for (const char* claim : {"holds", "swings", "offset"})
      EXPECT_EQ(result_of(report, claim), "held") << claim << " " << unit << ended.output;
  }
}

/// A signal of a message, its value as it is computed, and the raw value of its frame.
struct Sent {
  const char* unit;
  const char* value;  ///< of a quantity of the block
  const char* quantity;
  double factor;  ///< raw values for 1 of the quantity
};
constexpr Sent all_sent[] = {
    {"l/100km", "VALUE l/h / (100 km/h)", "m2", 1.0},
    {"kWh/100km", "VALUE kW / (100 km/h)", "N", 1.0},
    {"10mV", "VALUE V", "V", 100.0},
    {"100ms", "VALUE s", "s", 10.0},
    {"0.5%", "VALUE %", "'%'", 2.0},
    {"1/min", "VALUE rpm", "rpm", 1.0},
    {"rpm", "VALUE 1/min", "Hz", 1.0},
    {"Hz", "VALUE rpm * 60", "rpm", 1.0},
    {"rad/s", "VALUE m/s / (1 m)", "rad/s", 1.0},
    {"1/s", "VALUE m/s / (1 m)", "1/s", 1.0},
    {"deg/s", "VALUE rpm", "rpm", 6.0},
    {"rpm", "VALUE m/s / (1 m) * 60 rev", "rpm", 3600.0},
    {"10ohm", "VALUE Ohm", "Ohm", 0.1},
    {"0.1degC", "VALUE degC", "degC", 10.0},
    {"", "VALUE", "'1'", 1.0},
};

TEST(Units, WhatDependsOnWhereAScaleBeginsIsRefused) {
  for (const std::string unit : {"degC", "degF", "K"}) {
    const std::string plant =
        "scenario: scales\nbase_rate: 100 Hz\nduration: 1 s\nclock: virtual\ntasks:\n"
        "  - {module: p, type: block, rate: 100 Hz, parameters: {outputs: {t: {value: 300 K, unit: " +
        unit +
        "}, d: {value: 5 degC - 3 degC, unit: K}}}}\n"
        "  - {module: q, type: block, rate: 100 Hz, inputs: {t: p.t}, parameters: {inputs: {t: {unit: K, "
        "initial: 300 K}}, outputs: {y: {value: t, unit: K}}}}\n";
    const std::string claim =
        "expectations:\n  - {name: c, statistics: {signal: p.SIGNAL, FIGURE: {max: 900 K}}}\n";
    const auto code_of = [&](const std::string& signal, const std::string& figure) {
      std::string text = plant + claim;
      text.replace(text.find("SIGNAL"), 6, signal).replace(text.find("FIGURE"), 6, figure);
      return ScenarioFolder(text).run("out").code;
    };
    EXPECT_EQ(code_of("t", "rms"), unit == "K" ? 0 : 2) << unit;
    EXPECT_EQ(code_of("d", "rms"), 0) << "a difference";
    EXPECT_EQ(code_of("t", "mean"), 0) << unit;
    EXPECT_EQ(code_of("t", "standard_deviation"), 0) << unit;
    const auto with_fault = [&](const std::string& effect) {
      return ScenarioFolder(plant + "faults: [{name: f, signal: p.t, " + effect + "}]\n").run("out").code;
    };
    EXPECT_EQ(with_fault("gain: 2"), unit == "K" ? 0 : 2) << unit;
    EXPECT_EQ(with_fault("offset: 2 K"), 0) << unit;
    const ScenarioFolder files(plant +
                               "expectations: [{name: c, statistics: {signal: p.t, mean: {max: 900 K}}}]\n");
    const Ended ended = files.run("out");
    const auto report = read_report(files.folder / "out");
    EXPECT_EQ(report["expectations"][0]["detail"].get<std::string>().find("rms") != std::string::npos,
              unit == "K")
        << report["expectations"][0];
  }
}

TEST(Units, RandomValuesAreSentInTheUnitsOfTheFile) {
  std::mt19937 random(23);
  for (int round = 0; round < 4; ++round) {
    std::string database = "VERSION \"\"\nNS_ :\nBS_:\nBU_: A B\n", send, outputs, expected;
    std::size_t id = 100;
    for (const Sent& sent : all_sent) {
      const int value = 10 * static_cast<int>(1 + random() % 60);
      const std::string name = "S" + std::to_string(id);
      database += "BO_ " + std::to_string(id) + " M" + name + ": 4 B\n SG_ " + name +
                  " : 0|32@1+ (1,0) [0|4294967295] \"" + sent.unit + "\" A\n";
      send += "      - {message: M" + name + ", period: 10 ms, signals: {" + name + ": p." + name + "}}\n";
      std::string text = sent.value;
      text.replace(text.find("VALUE"), 5, std::to_string(value));
      outputs += "        " + name + ": {value: " + text + ", unit: " + sent.quantity + "}\n";
      const auto raw = static_cast<unsigned long>(std::lround(value * sent.factor));
      char frame[32];
      std::snprintf(frame, sizeof(frame), "%03zX#%02lX%02lX%02lX%02lX", id, raw & 255, raw >> 8 & 255,
                    raw >> 16 & 255, raw >> 24);
      expected += std::string(frame) + "\n";
      ++id;
    }
    const ScenarioFolder files(
        "scenario: sent\nbase_rate: 1 kHz\nduration: 50 ms\nclock: virtual\ncan:\n"
        "  - bus: car\n    device: virtual\n    database: s.dbc\n    rate: 100 Hz\n"
        "    send:\n" +
        send +
        "tasks:\n  - module: p\n    type: block\n    rate: 100 Hz\n    parameters:\n"
        "      outputs:\n" +
        outputs);
    write_text(files.folder / "s.dbc", database);
    const Ended ended = files.run("out");
    ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
    const std::string log = read_text(files.folder / "out/can-car.log");
    for (std::size_t begin = 0; begin < expected.size(); begin = expected.find('\n', begin) + 1) {
      const std::string frame = expected.substr(begin, expected.find('\n', begin) - begin);
      EXPECT_NE(log.find(frame), std::string::npos) << frame << "\n" << log.substr(0, 1500);
    }
  }
}

constexpr const char* without_units = R"(
scenario: without_units
base_rate: 1 kHz
duration: 100 ms
clock: virtual
can:
  - bus: car
    device: virtual
    database: s.dbc
    rate: 1 kHz
    receive: [{message: In, timeout: 1 s}]
    send: [{message: Out, period: 10 ms, signals: {Level: p.half, Share: p.half}}]
    play: {file: in.log}
tasks:
  - module: p
    type: block
    rate: 1 kHz
    inputs: {level: can.car.In.Level}
    parameters:
      inputs: {level: {unit: "%", initial: 0}}
      outputs: {half: {value: 0.5}, read: level}
expectations:
  - {name: compared, always: not known(can.car.In.Level) or can.car.In.Level > 50 %}
  - {name: read, eventually: p.read > 199.9 % and p.read < 200.1 %, by: 50 ms}
)";

TEST(Units, SignalsWithoutAUnitAreInTheSiAndTheCheckWarns) {
  const ScenarioFolder files(without_units);
  write_text(
      files.folder / "s.dbc",
      "VERSION \"\"\nNS_ :\nBS_:\nBU_: A B\nBO_ 100 In: 1 B\n SG_ Level : 0|8@1+ (1,0) [0|255] \"\" A\n"
      "BO_ 101 Out: 2 A\n SG_ Level : 0|8@1+ (1,0) [0|255] \"\" B\n"
      " SG_ Share : 8|8@1+ (1,0) [0|255] \"%\" B\n");
  write_text(files.folder / "in.log", "(0.000000) car 064#02\n(0.050000) car 064#02\n");
  const Ended check = run_hil({"check", files.folder / "s.yaml"});
  const std::string text = check.output + check.errors;
  EXPECT_NE(text.find("'can.car.In.Level' has no unit, so it is in the SI, and 1 is 100 %"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("'p.half' has no unit, so it is in the SI, and 1 is 100 %"), std::string::npos) << text;
  const Ended ended = files.run("out");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(result_of(report, "compared"), "held");
  EXPECT_EQ(result_of(report, "read"), "held");
  EXPECT_NE(read_text(files.folder / "out/can-car.log").find("065#0132"), std::string::npos)
      << "0.5, rounded, and 50 %";

  std::string given = without_units;
  given.insert(given.find("    receive:"), "    units: {In: {Level: \"%\"}}\n");
  write_text(files.folder / "s.yaml", given);
  const Ended other = run_hil({"check", files.folder / "s.yaml"});
  EXPECT_EQ((other.output + other.errors).find("'can.car.In.Level' has no unit"), std::string::npos)
      << other.output << other.errors;
}

TEST(Units, LimitsOfASignalWithoutAUnitAreWarnedOf) {
  const std::string base =
      "scenario: limits\nbase_rate: 1 kHz\nduration: 100 ms\nclock: virtual\n"
      "can: [{bus: car, device: virtual, database: s.dbc, rate: 1 kHz, play: {file: in.log}, receive: "
      "[{message: In, timeout: 1 s}]UNITS}]\n";
  for (const char* const rest :
       {"expectations: [{name: c, tracks: {signal: can.car.In.Level, reference: level.csv, tolerance: 10 "
        "%}}]",
        "expectations: [{name: c, statistics: {signal: can.car.In.Level, largest: {max: 600 %}}}]",
        "expectations: [{name: c, statistics: {signal: can.car.In.Level, mean: {min: 1 %}}}]",
        "expectations: [{name: c, statistics: {signal: can.car.In.Level, overshoot: {of: 300 %, at_most: 5 "
        "%}}}]",
        "variables: {share: {value: can.car.In.Level, unit: \"%\"}}",
        "test_tables: [{name: t, file: table.csv}]"}) {
    for (const bool has_unit : {false, true}) {
      std::string text = base + rest + "\n";
      text.replace(text.find("UNITS"), 5, has_unit ? ", units: {In: {Level: \"%\"}}" : "");
      const ScenarioFolder files(text);
      write_text(files.folder / "s.dbc",
                 "VERSION \"\"\nNS_ :\nBS_:\nBU_: A B\nBO_ 100 In: 1 B\n"
                 " SG_ Level : 0|8@1+ (1,0) [0|255] \"\" A\n");
      write_text(files.folder / "in.log", "(0.000000) car 064#02\n");
      write_text(files.folder / "level.csv", "time,level\n0,2\n4,2\n");
      write_text(files.folder / "table.csv",
                 "time,signal,value,fault,expectation,tolerance\n0.05,can.car.In.Level,,,200 %,5 %\n");
      const Ended check = run_hil({"check", files.folder / "s.yaml"});
      const std::string found = check.output + check.errors;
      EXPECT_EQ(check.code, 0) << found;
      const bool warns = found.find("'can.car.In.Level' has no unit, so it is in the SI, and 1 is 100 %") !=
                         std::string::npos;
      EXPECT_EQ(warns, !has_unit) << rest << "\n" << found;
    }
  }
}

}  // namespace
}  // namespace hil::scenario_test
