// Recordings of runs: the same bytes twice, the size limit, mistakes, and files that can not be written.

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/unit/runtime_recording/mcap_reader.hpp"

namespace hil::scenario_test {
namespace {

constexpr const char* lags_scenario = R"(
scenario: lags
clock: virtual
duration: 2 s
tasks:
  - module: lag
    type: block
    rate: 1 kHz
    parameters:
      inputs: {u: {initial: 0}}
      states: {x: {derivative: (u - x) / 50 ms}, y: {derivative: (x - y) / 30 ms}}
stimuli:
  - {name: noisy, drives: lag.u, sequence: [{noise: {mean: 0, deviation: 1}}]}
expectations:
  - {name: runs, eventually: time >= 1.9 s and lag.x > -100}
)";

class RecordingTest : public ::testing::Test {
 protected:
  Ended run(const std::string& recording, const std::string& out, const std::vector<std::string>& more = {}) {
    write_text(folder_ / "s.yaml", lags_scenario + recording + "\n");
    return run_hil(joined({{"run", folder_ / "s.yaml", "--out", folder_ / out}, more}));
  }
  recording::test::ReadMcap read(const std::string& out) const {
    auto file = recording::test::read_mcap(read_text(folder_ / (out + "/recording.mcap")));
    for (const std::string& fault : file.faults)
      ADD_FAILURE() << fault;
    return file;
  }
  /// The refusal of a scenario with this section.
  std::string refusal(const std::string& recording) {
    const Ended ended = run(recording, "refused");
    EXPECT_EQ(ended.code, 2) << ended.output << ended.errors;
    return ended.errors;
  }

  const Folder folder_;
};

TEST_F(RecordingTest, TwoVirtualRunsLeaveTheSameBytes) {
  for (const char* out : {"a", "b"})
    ASSERT_EQ(run_hil(joined({{"run", crossing(), "--out", folder_ / out, "--set", "clock=virtual", "--set",
                               "duration=2 s", "--set", "recording.signals=['can.*', 'traffic.*']"},
                              few_beams()}))
                  .code,
              1);
  const std::string first = read_text(folder_ / "a/recording.mcap");
  EXPECT_GT(first.size(), 10'000U);
  EXPECT_TRUE(first == read_text(folder_ / "b/recording.mcap"));
  const auto file = read("a");
  EXPECT_FALSE(file.of("/traffic").empty());
  EXPECT_FALSE(file.of("/can.car.BrakeCommand").empty());
  EXPECT_EQ(file.of("/frames/can.car").size(), read_can_log(folder_ / "a/can-car.log").size());
  for (const auto& [topic, schema] : file.schemas)
    EXPECT_FALSE(topic.starts_with("/scanner") || topic.starts_with("/modbus")) << topic;
}

TEST_F(RecordingTest, WithoutTheSectionThereIsNone) {
  EXPECT_EQ(run("", "out").code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/recording.mcap"));
  EXPECT_TRUE(read_report(folder_.path() / "out")["recording"].is_null());
  EXPECT_EQ(run("recording: {enabled: false, signals: [lag.x]}", "off").code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "off/recording.mcap"));
}

TEST_F(RecordingTest, HasTheSelectedSignals) {
  ASSERT_EQ(run("recording: {signals: ['*.y', lag.x]}", "out").code, 0);
  const auto file = read("out");
  const auto messages = file.of("/lag");
  ASSERT_EQ(messages.size(), 2'000U);
  EXPECT_TRUE(messages[1].data.starts_with("{\"x\":") &&
              messages[1].data.find(",\"y\":") != std::string::npos);
  EXPECT_FALSE(file.schemas.contains("/stimuli"));
  EXPECT_EQ(file.metadata.at("run").at("scenario"), "lags");
  const Signals signals(folder_.path() / "out");
  ASSERT_EQ(signals["lag.x"].size(), 200U);
  for (std::size_t row = 0; row < 200; ++row) {
    const auto recorded = nlohmann::json::parse(messages[10 * row].data);
    ASSERT_EQ(recorded["x"].get<double>(), signals["lag.x"][row]);
    ASSERT_EQ(recorded["y"].get<double>(), signals["lag.y"][row]);
  }
}

TEST_F(RecordingTest, StopsAtItsSizeLimitAndTheReportSaysWhen) {
  const Ended ended = run("recording: {max_size: 1 MiB}", "out", {"--set", "duration=60 s"});
  EXPECT_EQ(ended.code, 0) << ended.errors;
  const auto recorded = read_report(folder_.path() / "out")["recording"];
  EXPECT_LE(std::filesystem::file_size(folder_ / "out/recording.mcap"), 1U << 20U);
  EXPECT_EQ(recorded["bytes"], std::filesystem::file_size(folder_ / "out/recording.mcap"));
  const auto file = read("out");
  EXPECT_EQ(file.messages.size(), recorded["messages"].get<std::size_t>());
  const auto messages = file.of("/lag");
  const auto stopped_at = recorded["stopped_at_ns"].get<std::uint64_t>();
  EXPECT_GE(stopped_at, messages.back().log_time);
  EXPECT_LE(stopped_at, messages.back().log_time + 1'000'000);
  EXPECT_EQ(file.messages.size() + recorded["not_recorded"].get<std::size_t>(), 120'001U)
      << "two topics on 60,000 ticks, and an event";
  EXPECT_EQ(file.of("/events").size(), 1U);
  EXPECT_NE(ended.output.find("degraded: recording.mcap reached its largest size at "), std::string::npos)
      << ended.output;
  EXPECT_NE(read_text(folder_ / "out/report.html").find("reached its largest size at "), std::string::npos);
}

TEST_F(RecordingTest, MistakesAreRefusedWithTheirPlaces) {
  EXPECT_NE(refusal("recording: {signals: [lag.z]}").find("there is no signal 'lag.z'"), std::string::npos);
  EXPECT_NE(refusal("recording: {signals: ['lug.*']}").find("no signal has a name like 'lug.*'"),
            std::string::npos);
  EXPECT_NE(refusal("recording: {signals: ['a b']}")
                .find("'a b' is neither the name of a signal nor a pattern like plant.*"),
            std::string::npos);
  const std::string size = refusal("recording: {max_size: 1 MB}");
  EXPECT_NE(size.find("has the unit 'MB', but a size of data is written in B, KiB, MiB, GiB"),
            std::string::npos)
      << size;
  const std::string small = refusal("recording: {max_size: 1023 KiB}");
  EXPECT_NE(small.find("it can be from 1 MiB to 1 TiB"), std::string::npos) << small;
  EXPECT_NE(refusal("recording: maybe").find("true or false"), std::string::npos);
}

TEST_F(RecordingTest, FileThatCanNotBeWrittenCompletelyIsAFailure) {
  write_text(folder_ / "s.yaml", std::string(lags_scenario) + "recording: true\n");
  // No file may be longer than 512 * 512 bytes.
  const Ended ended =
      Program(joined({{"sh", "-c", "ulimit -f 512; exec \"$@\"", "sh"},
                      hil({"run", folder_ / "s.yaml", "--out", folder_ / "out", "--set", "duration=20 s"})}))
          .wait();
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  const std::string sentence = folder_ / "out/recording.mcap could not be written completely: File too large";
  EXPECT_NE((ended.output + ended.errors).find(sentence), std::string::npos) << ended.output << ended.errors;
  EXPECT_EQ(std::filesystem::file_size(folder_ / "out/recording.mcap"), 512U * 512U);
}

TEST_F(RecordingTest, RemovedFileIsAFailureInRealTime) {
  write_text(folder_ / "s.yaml", std::string(lags_scenario) + "recording: true\n");
  Program run(hil(joined(
      {{"run", folder_ / "s.yaml", "--out", folder_ / "out", "--set", "clock=realtime"}, relaxed_timing()})));
  ASSERT_TRUE(run_begins(run, folder_ / "out"));
  ASSERT_TRUE(std::filesystem::remove(folder_ / "out/recording.mcap"));
  const Ended ended = run.wait();
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  EXPECT_NE(ended.output.find("out/recording.mcap was removed while the run went on"), std::string::npos)
      << ended.output;
}

TEST_F(RecordingTest, RealTimeRunIsRecordedTickByTick) {
  const Ended ended = run("recording: true", "out", joined({{"--set", "clock=realtime"}, relaxed_timing()}));
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  const auto report = read_report(folder_.path() / "out");
  EXPECT_EQ(report["recording"]["dropped"], 0);
  const auto messages = read("out").of("/lag");
  ASSERT_EQ(messages.size(), report["ticks"].get<std::size_t>());
  for (std::size_t i = 0; i < messages.size(); ++i)
    ASSERT_EQ(messages[i].log_time % 1'000'000, 0U);
  EXPECT_EQ(messages[0].log_time, 0U);
}

}  // namespace
}  // namespace hil::scenario_test
