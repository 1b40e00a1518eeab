// Every kind of stimulus, fault, trigger and expectation, active in one run: what faults do to frames, the
// margins of expectations, and equal files of two runs. What stimuli and faults do to signals, the
// expectations of the scenario state.

#include "tests/system/scenario/all_kinds.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "io/can/checksum.hpp"

namespace hil::scenario_test {
namespace {

using Json = nlohmann::json;

/// By the name of the expectation: the margin, in the unit of the signal or in s, and the ms of its instant.
const std::map<std::string, std::pair<double, std::int64_t>> expected_margins{
    {"never", {0.5, 1500}},       {"eventually", {0.001, 1000}}, {"reaction", {0.005, 120}},
    {"count", {0.0, 500}},        {"order", {0.01, 130}},        {"tracks", {0.001, 250}},
    {"statistics", {0.001, 390}}, {"fresh", {0.02, 10}},         {"cycle time", {0.001, 10}},
    {"response", {0.001, 0}},     {"train again", {0.0, 1390}},  {"dropout", {7.0, 848}},
};

struct LogLine {
  std::int64_t time_ms = 0;
  std::vector<std::uint8_t> payload;
  bool operator==(const LogLine&) const = default;
};

std::ostream& operator<<(std::ostream& out, const LogLine& line) {
  out << line.time_ms << " ms:";
  for (const std::uint8_t byte : line.payload)
    out << " " << static_cast<int>(byte);
  return out;
}

/// EgoStatus on the bus. The speed, 10 m/s2 * time, counts 1 in a millisecond; the counter is that of the
/// frame.
std::vector<LogLine> expected_frames() {
  constexpr std::uint8_t id = 0x00;  // the low byte of 0x100
  std::vector<LogLine> lines;
  std::uint8_t counter = 0;
  const auto payload_of = [&](std::int64_t speed, std::int64_t count) {
    std::vector<std::uint8_t> payload(8, 0);
    payload[0] = static_cast<std::uint8_t>(speed & 0xFF);
    payload[1] = static_cast<std::uint8_t>(speed >> 8);
    payload[4] = static_cast<std::uint8_t>(count % 16);
    std::vector<std::uint8_t> checked = payload;
    checked.insert(checked.begin(), id);
    payload[7] = io::can::crc8_sae_j1850(checked);
    return payload;
  };
  for (std::int64_t ms = 0; ms < 2000; ms += 10) {
    const auto in = [ms](std::int64_t begin_ms) { return ms >= begin_ms && ms < begin_ms + 50; };
    if (in(1800)) continue;  // bus_off
    LogLine line{ms, payload_of(in(500) ? 490 : ms, in(600) ? 59 : counter)};
    ++counter;
    if (ms == 220 || ms == 230) continue;  // two of five frames, by seed 1
    if (in(400)) line.time_ms += 3;
    if (in(100)) line.payload[1] ^= 0x01;
    if (in(700)) line.payload[7] ^= 0xFF;
    if (in(800)) line.payload.resize(4);
    if (in(900)) {
      line.payload[0] ^= 0x01;
      line.payload[4] ^= 0x80;
    }
    lines.insert(lines.end(), in(300) ? 3 : 1, line);
  }
  lines.push_back({1999, payload_of(0, counter)});  // the safe value, at the end
  return lines;
}

TEST(AllKinds, HaveTheirEffects) {
  const Folder folder;
  const Json report = run_all_kinds(folder / "out");
  for (const Json& expectation : report["expectations"]) {
    EXPECT_EQ(expectation["result"], "held") << expectation.dump(1);
    const auto margin = expected_margins.find(expectation["name"]);
    if (margin == expected_margins.end()) continue;
    EXPECT_NEAR(expectation["margin"].get<double>(), margin->second.first, 1e-9) << expectation.dump(1);
    EXPECT_EQ(expectation["worst_ns"], 1'000'000 * margin->second.second) << expectation.dump(1);
  }

  std::vector<LogLine> frames;
  for (const io::can::LoggedFrame& logged : read_can_log(folder / "out/can-car.log")) {
    const auto payload = logged.frame.payload();
    if (logged.frame.raw.can_id == 0x100)
      frames.push_back({logged.frame.wall_ns / 1'000'000, {payload.begin(), payload.end()}});
  }
  EXPECT_EQ(frames, expected_frames());
  const Json& car = report["can"][0];
  EXPECT_EQ(car["bad_checksum"], 15) << "wrong, short and flipped frames, five each";
  EXPECT_EQ(car["bad_counter"], 12) << "five repeated ones, five with a wrong counter, and the first ones "
                                       "after those and after the dropped "
                                       "ones";
  ASSERT_EQ(car["rejected"].size(), 1U);
  EXPECT_EQ(car["rejected"][0]["by_scenario"], 27) << "all of them";
  for (const Json& task : report["tasks"]) {
    const int misses = task["name"] == "slow" ? 5 : 0;
    EXPECT_EQ(task["deadline_misses"], misses) << task["name"] << ": each step of 12 ms covers two releases";
  }
  EXPECT_EQ(report["modbus"][0]["exceptions"][0]["code"], 6);
}

TEST(AllKinds, TakeEffect) {
  const Folder folder;
  const Json report = run_all_kinds(folder / "out");
  for (const char* const list : {"stimuli", "faults"}) {
    for (const Json& one : report[list]) {
      const bool is_of_process = one["target"] == "spare";  // whether a pause has one is not known
      EXPECT_EQ(one["took_effect"], is_of_process ? Json() : Json(true)) << one.dump(1);
      EXPECT_EQ(one["missing_effect"], "") << one.dump(1);
    }
  }
}

TEST(AllKinds, RunsAreByteForByteAlike) {
  const Folder folder;
  const Json one = run_all_kinds(folder / "one"), two = run_all_kinds(folder / "two");
  for (const char* file : {"signals.csv", "can-car.log", "can-spare.log", "recording.mcap"}) {
    const std::string content = read_text(folder.path() / "one" / file);
    EXPECT_FALSE(content.empty()) << file;
    EXPECT_TRUE(content == read_text(folder.path() / "two" / file)) << file;
  }
  for (const char* part : {"verdict", "reason", "stimuli", "faults", "expectations", "losses", "failures",
                           "modbus", "response_times", "events", "recording", "signal_plots"}) {
    EXPECT_TRUE(one.contains(part)) << part;
    EXPECT_EQ(one[part].dump(), two[part].dump()) << part;
  }
}

}  // namespace
}  // namespace hil::scenario_test
