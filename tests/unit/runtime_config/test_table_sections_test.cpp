// Test tables: what their rows become, and their mistakes.

#include <gtest/gtest.h>

#include "config_fixture.hpp"
#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

class TestTables : public ::testing::Test {
 protected:
  std::optional<Scenario> load(const std::string& csv, const std::string& more = "") {
    diagnostics_ = {};
    folder_.write("t.csv", csv);
    const std::string file = folder_.write(
        "s.yaml",
        "scenario: s\nbase_rate: 1 kHz\nduration: 1 s\ntest_tables: [{name: t, file: t.csv}]\n" + more);
    return load_scenario(file, {}, test::test_scenario_types(), diagnostics_);
  }
  /// The mistakes, or the warnings, without the folder.
  std::string texts() const {
    std::string text = diagnostics_.to_text();
    const std::string folder = folder_.path().string() + "/";
    for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder))
      text.erase(at, folder.size());
    return text;
  }
  static std::vector<StimulusSegment> segments_of(const StimulusSection& stimulus) {
    return std::get<std::vector<StimulusSegment>>(stimulus.profile);
  }

  static constexpr std::int64_t ms = 1'000'000;
  const tests::TemporaryFolder folder_;
  Diagnostics diagnostics_;
};

TEST_F(TestTables, ValuesAreOneStimulusForEachSignal) {
  const auto scenario = load("signal,time,value\na.x,0.1,1 m\nb.y,0.1,7\na.x,0.2,2\na.x,0.5,3 + 4\n");
  ASSERT_TRUE(scenario) << texts();
  ASSERT_EQ(scenario->stimuli.size(), 2U);
  const StimulusSection& x = scenario->stimuli[0];
  EXPECT_EQ(x.name.text, "t.a.x");
  EXPECT_EQ(x.drives.text, "a.x");
  EXPECT_EQ(x.activation.at_ns, 100 * ms);
  const auto segments = segments_of(x);
  ASSERT_EQ(segments.size(), 3U);
  EXPECT_EQ(segments[0].for_ns, 100 * ms);
  EXPECT_EQ(segments[1].for_ns, 300 * ms);
  EXPECT_EQ(segments[2].for_ns, std::nullopt);
  EXPECT_EQ(segments[2].waveform->expressions()[0].text(), "3 + 4");
  EXPECT_EQ(scenario->stimuli[1].name.text, "t.b.y");
}

TEST_F(TestTables, ChangesAreInTheFirstTickNotBeforeThem) {
  const auto scenario =
      load("time,signal,value,fault\n0.0101,a.x,1,\n0.0199,a.x,2,gain 2\n0.025,a.x,,none\n");
  ASSERT_TRUE(scenario) << texts();
  EXPECT_EQ(scenario->stimuli[0].activation.at_ns, 11 * ms);
  EXPECT_EQ(segments_of(scenario->stimuli[0])[0].for_ns, 9 * ms);
  EXPECT_EQ(scenario->faults[0].activation.at_ns, 20 * ms);
  EXPECT_EQ(scenario->faults[0].activation.for_ns, 5 * ms);
}

TEST_F(TestTables, FaultsLastToTheNextState) {
  const auto scenario = load(
      "time,signal,fault\n0,a,none\n0.1,a,stuck\n0.2,a,stuck 5 m\n0.3,a,release\n0.4,a,offset 2 cm\n"
      "0.4,b,dropout 30 %\n0.5,a,delay 50 ms\n0.6,b,none\n");
  ASSERT_TRUE(scenario) << texts();
  std::string all;
  for (const FaultSection& fault : scenario->faults) {
    all += fault.name.text + " " + fault.subject.text + " " + fault.effect->sentence() + " at " +
           std::to_string(*fault.activation.at_ns / ms) +
           (fault.activation.for_ns ? " for " + std::to_string(*fault.activation.for_ns / ms) : "") + "\n";
  }
  EXPECT_EQ(all,
            "t.line_3 a stuck at its last value at 100 for 100\n"
            "t.line_4 a stuck at 5 m at 200 for 100\n"
            "t.line_6 a offset by 2 cm at 400 for 100\n"
            "t.line_7 b without value in 30 % of the ticks at 400 for 200\n"
            "t.line_8 a delayed by 50 ms at 500\n");
}

TEST_F(TestTables, ExpectationsAreOneForEachSignal) {
  const auto scenario = load(
      "timestamp,channel,expectation,tolerance,comment\n0,a.x,1,0.1,\n0.1,b.y,limp,,first\n0.2,a.x,2,0.1,\n",
      "expectations: [{name: own, always: time < 5}]\n");
  ASSERT_TRUE(scenario) << texts();
  ASSERT_EQ(scenario->expectations.size(), 3U);
  EXPECT_EQ(scenario->expectations[0].name, "t: a.x");
  EXPECT_EQ(scenario->expectations[1].name, "t: b.y");
  EXPECT_EQ(scenario->expectations[0].coverage, 1.0) << "each instant counts";
}

TEST_F(TestTables, RowsAfterTheLastTickAreRefused) {
  const std::string head = "time,signal,value,fault,expectation,tolerance\n";
  EXPECT_TRUE(load(head + "0.999,a,2,,,\n")) << texts();
  EXPECT_FALSE(load(head + "0.5,a,1,,,\n1,a,2,,,\n2,a,,stuck,1,1\n"));
  EXPECT_EQ(texts(),
            "t.csv:3:3: the time of this row, 1 s, is not before the end of the run, which takes 1 s; give "
            "an earlier time or a longer duration (the first of 2 such rows)\n");
  for (const char* const row : {"0.9995,a,1,,,\n", "0.9995,a,,stuck,,\n", "0.9995,a,,,1,1\n"}) {
    EXPECT_FALSE(load(head + row));
    EXPECT_EQ(texts(),
              "t.csv:2:8: the time of this row, 999.5 ms, is after the last tick of the run, at 999 ms; "
              "give an earlier time or a longer duration\n");
  }
}

TEST_F(TestTables, MayHaveSemicolonsAndCellsInQuotes) {
  const auto scenario = load(
      "time;signal;value;fault;comment\n0;a.x;max(1, 2);;3,4\n0.1;\"a.x\";\"5\";;\"; not \"\"read\"\"\"\n"
      "0.2;b;;offset 0.5 m;\n");
  ASSERT_TRUE(scenario) << texts();
  const auto segments = segments_of(scenario->stimuli[0]);
  ASSERT_EQ(segments.size(), 2U);
  EXPECT_EQ(segments[0].waveform->expressions()[0].text(), "max(1, 2)");
  EXPECT_EQ(segments[1].waveform->expressions()[0].text(), "5");
  const auto quoted = load("time,signal,value\n0,a.x,\"max(1, 2)\"\n");
  ASSERT_TRUE(quoted) << texts();
  EXPECT_EQ(segments_of(quoted->stimuli[0])[0].waveform->expressions()[0].text(), "max(1, 2)");
}

TEST_F(TestTables, SayWhatToWriteForADecimalComma) {
  EXPECT_FALSE(
      load("time;signal;value;fault;expectation;tolerance\n0,1;a;1;;;\n0.2;a;1,5 m;;;\n0.3;a;;offset -0,5;;\n"
           "0.4;a;;delay 0,5 s;;\n0.5;a;;;2,5;1,0\n"));
  EXPECT_EQ(texts(),
            "t.csv:2:1: '0,1' has a decimal comma; write 0.1\n"
            "t.csv:3:7: '1,5 m' has a decimal comma; write 1.5 m\n"
            "t.csv:4:15: '-0,5' has a decimal comma; write -0.5\n"
            "t.csv:5:14: '0,5 s' has a decimal comma; write 0.5 s\n"
            "t.csv:6:9: '2,5' has a decimal comma; write 2.5\n"
            "t.csv:6:13: '1,0' has a decimal comma; write 1.0\n");
}

TEST_F(TestTables, HaveMistakesAtTheirPlaces) {
  const std::string head = "time,signal,value,fault,expectation,tolerance\n";
  const struct {
    std::string csv, mistake;
  } all[] = {
      {"", "s.yaml:4:31: the file has no rows"},
      {head, "s.yaml:4:31: the file has no rows"},
      {"time,signal,valeu\n0,a,1\n",
       "t.csv:1:13: a test table has no column 'valeu'; did you mean 'value'? Known here: value, time, "
       "signal, fault, expectation, tolerance, comment"},
      {"time,value\n0,1\n", "t.csv:1:1: a test table needs a column 'signal'"},
      {"time,signal,value,value\n0,a,1,1\n", "t.csv:1:19: there are two columns 'value'"},
      {head + "0,a,1,,,\n1\n", "t.csv:3:1: the row has 1 cell and the file 6 columns"},
      {"time,signal,value,channel\n0,a,1,b\n", "t.csv:1:19: there are two columns 'signal'"},
      {head + ",a,1,,,\n", "t.csv:2:1: an empty cell: a number is missing"},
      {head + "-1,a,1,,,\n", "t.csv:2:1: a time is from 0 s to 1e9 s"},
      {head + "0.2,a,1,,,\n0.1,a,1,,,\n", "t.csv:3:1: a time before that of the row before"},
      {head + "0,,1,,,\n", "t.csv:2:3: an empty cell: a signal is missing"},
      {head + "0,a,,,,\n", "t.csv:2:1: the row has neither a value nor a fault nor an expectation"},
      {head + "0,a,1 +,,,\n", "t.csv:2:8: the expression ends where a signal or a number is expected"},
      {head + "0,a,1,,,5\n", "t.csv:2:9: a tolerance without an expectation"},
      {head + "0,a,,stuk,,\n",
       "t.csv:2:6: 'stuk' is no state of a fault; did you mean 'stuck'? Known here: stuck, none, release, "
       "offset, gain, noise, drift, delay, dropout"},
      {head + "0,a,,offset,,\n", "t.csv:2:6: 'offset' needs its value, as 'offset 2 cm'"},
      {head + "0,a,,gain  2 +,,\n", "t.csv:2:15: the expression ends where a signal or a number is expected"},
      {head + "0,a,,release 5,,\n", "t.csv:2:14: 'release' has no value"},
      {head + "0,a,,delay 5,,\n", "t.csv:2:12: '5' has no unit; "},
      {head + "0,a,,delay 2 min,,\n", "t.csv:2:12: '2 min' is out of range; it can be above 0 s, up to 60 s"},
      {head + "0,a,,delay 1.5 ms,,\n",
       "t.csv:2:6: a delay of 1.5 ms is no multiple of the base period of 1 ms"},
      {head + "0,a,,dropout 130 %,,\n", "t.csv:2:14: '130 %' is out of range; it can be from 0 % to 100 %"},
      {head + "0.0001,a,1,,,\n0.0009,a,2,,,\n",
       "t.csv:3:10: 'a' has a value in line 2, in the same tick at 1 ms"},
      {head + "0,a,,stuck,,\n0,a,,none,,\n", "t.csv:3:6: 'a' has a fault in line 2, in the same tick at 0"},
      {head + "0,a,,,1,1\n0,a,,,2,1\n", "t.csv:3:7: 'a' has an expectation in line 2, in the same tick at 0"},
  };
  for (const auto& one : all) {
    EXPECT_FALSE(load(one.csv)) << one.csv;
    EXPECT_EQ(texts().substr(0, one.mistake.size()), one.mistake) << texts();
    EXPECT_EQ(diagnostics_.count(), 1U) << texts();
  }
}

TEST_F(TestTables, HaveLimits) {
  std::string rows = "time,signal,value,fault\n", faults = rows;
  for (int i = 0; i <= 10'000; ++i)
    rows += "0,a" + std::to_string(i) + ",1,\n";
  EXPECT_FALSE(load(rows));
  EXPECT_EQ(texts(), "t.csv:10002:1: the file has more rows than the limit of 10000; split it\n");
  for (int i = 0; i <= 1'001; ++i)
    faults += "0,a" + std::to_string(i) + ",,gain 2\n";
  EXPECT_FALSE(load(faults));
  EXPECT_EQ(texts(), "t.csv:1002:10: the test table has more faults than the limit of 1000; split it\n");
}

}  // namespace
}  // namespace hil::config
