// Runs with a test table: a pump's steps, a sensor's faults and what has to be seen of them, in one file.

#include <gtest/gtest.h>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

constexpr const char* table_scenario = R"(
scenario: tank by a table
clock: virtual
base_rate: 1 kHz
duration: 6 s
tasks:
  - module: tank
    type: block
    rate: 1 kHz
    parameters:
      inputs: {inflow: {unit: l/s, initial: 1}}
      states: {level: {initial: 1 m, derivative: (inflow - 1 l/s) / 0.04 m2, min: 0, max: 3 m}}
  - module: plc
    type: block
    rate: 1 kHz
    inputs: {level: tank.level}
    parameters:
      inputs: {level: mm}
      outputs: {trip: level > 1250 mm, seen: level}
test_tables:
  - {name: surge, file: surge.csv}
)";
// From 1 s on the level rises by 10 cm a second.
constexpr const char* table_rows =
    "# first the pump, then the sensor\n"
    "time,channel,value,fault,expectation,tolerance,comment\n"
    "0,tank.inflow,1,,,,steady\n"
    "1,tank.level,,none,1,1 mm,\n"
    "1,tank.inflow,0.3 m3/min,,,,5 l/s\n"
    "2,tank.level,,stuck,1.1 m,1 mm,before the trip\n"
    "4,plc.trip,,,0,0,\n"
    "4.0005,tank.level,,offset -20 cm,,,\n"
    "4.2,plc.seen,,,1120,1,\n"
    "4.5,tank.level,,release,,,\n"
    "4.502,plc.trip,,,1,0,\n"
    "5,tank.level,,,1.4 m,2 mm,\n";

struct TableScenario : ScenarioFolder {
  explicit TableScenario(const std::string& rows = table_rows) : ScenarioFolder(table_scenario) {
    write_text(folder / "surge.csv", rows);
  }
};

TEST(TestTable, ItsRowsActAndAreJudgedAtTheirInstants) {
  const TableScenario files;
  const Ended ended = files.run("out");
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(files.folder / "out");
  EXPECT_EQ(events_in_ms(report),
            "0 stimulus surge.tank.inflow begins\n"
            "2000 fault surge.line_6 begins: tank.level stuck at its last value\n"
            "4001 fault surge.line_6 ends\n"
            "4001 fault surge.line_8 begins: tank.level offset by -20 cm\n"
            "4500 fault surge.line_8 ends\n");
  const Signals signals(files.folder / "out");
  ASSERT_EQ(signals["tank.inflow"].size(), 600U);
  EXPECT_NEAR(signals["tank.inflow"][99], 1.0, 1e-12);
  EXPECT_NEAR(signals["tank.inflow"][100], 5.0, 1e-12);
  EXPECT_NEAR(signals["tank.level"][500], 1.4, 1e-9);

  const auto& expectations = report["expectations"];
  ASSERT_EQ(expectations.size(), 3U);
  EXPECT_EQ(expectations[0]["name"], "surge: tank.level");
  EXPECT_EQ(expectations[0]["covered_ticks"], 3);
  EXPECT_NEAR(expectations[0]["margin"].get<double>(), 1e-3, 1e-9);
  EXPECT_EQ(expectations[1]["name"], "surge: plc.trip");
  EXPECT_EQ(expectations[1]["margin"], 0.0);
  EXPECT_EQ(expectations[2]["name"], "surge: plc.seen");
  EXPECT_EQ(expectations[2]["worst_ns"], 4'200'000'000);
}

TEST(TestTable, ARowThatIsNotMetFailsTheRun) {
  std::string rows = table_rows;
  rows.replace(rows.find("4.2,plc.seen,,,1120,1"), 21, "4.2,plc.seen,,,1110,1");
  const TableScenario files(rows);
  const Ended ended = files.run("out");
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_NE(ended.output.find("plc.seen was wrong at 1 of 1 instant: 1120 mm in line 9 at 4.200 s, expected "
                              "1110 mm within 1 mm"),
            std::string::npos)
      << ended.output;
}

TEST(TestTable, RowsAfterTheEndAreRefused) {
  const TableScenario files;
  const Ended ended = files.run("out", {"--duration", "3 s"});
  EXPECT_EQ(ended.code, 2) << ended.output << ended.errors;
  EXPECT_NE(ended.errors.find(
                "surge.csv:7:3: the time of this row, 4 s, is not before the end of the run, "
                "which takes 3 s; give an earlier time or a longer duration (the first of 6 such rows)"),
            std::string::npos)
      << ended.errors;
}

TEST(TestTable, RunsAreByteForByteAlike) {
  const TableScenario files;
  ASSERT_EQ(files.run("one").code, 0);
  ASSERT_EQ(files.run("two").code, 0);
  EXPECT_EQ(read_text(files.folder / "one/signals.csv"), read_text(files.folder / "two/signals.csv"));
}

TEST(TestTable, HasItsMistakesFoundByCheck) {
  std::string rows = table_rows;
  const std::string more =
      "5.1,tank.inflwo,1,,,,\n"
      "5.2,tank.level,,offset 2 s,,,\n"
      "5.3,plc.trip,1,,,,\n"
      "5.4,plc.seen,,,1,1 s,\n"
      "5.5,plc.trip,,stuck,,,\n";
  const TableScenario files(rows + more);
  const Ended ended = run_hil({"check", files.folder / "s.yaml"});
  EXPECT_EQ(ended.code, 2);
  for (const char* const mistake :
       {"surge.csv:13:5: there is no input of a module and no output of a bus 'tank.inflwo'; did you mean "
        "'tank.inflow'?",
        "surge.csv:14:24: the value of fault 'surge.line_14' is in m; this is in s",
        "surge.csv:15:5: 'plc.trip' is written by module plc; a stimulus drives an input of a module or an "
        "output of a bus; known here: plc.level, tank.inflow",
        "surge.csv:16:18: 'tolerance' is in mm; this is in s",
        "surge.csv:17:5: no module and no bus reads 'plc.trip', so a fault of it has no effect"})
    EXPECT_NE(ended.errors.find(mistake), std::string::npos) << mistake << "\n" << ended.errors;
}

}  // namespace
}  // namespace hil::scenario_test
