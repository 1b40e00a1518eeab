// Every kind of stimulus, fault, trigger and expectation, active in one run: the exact instants of each, the
// frames that faults change, and equal files of two runs. What they do to signals, the expectations of the
// scenario state.

#include "tests/system/scenario/all_kinds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "io/can/checksum.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

using Json = nlohmann::json;
using Spans = std::vector<std::pair<std::int64_t, std::int64_t>>;  // first tick, tick of the end; in ms

constexpr std::int64_t run_end = 2000;

/// Those with a probability, from seed 1.
const std::map<std::string, Spans> spans_by_chance{
    {"stimulus lucky",
     {{0, 50},
      {200, 250},
      {500, 550},
      {600, 650},
      {900, 950},
      {1000, 1050},
      {1100, 1150},
      {1400, 1450},
      {1700, 1750},
      {1900, 1950}}},
    {"fault chance_at",
     {{50, 100},
      {150, 200},
      {250, 300},
      {350, 400},
      {450, 500},
      {950, 1000},
      {1250, 1300},
      {1450, 1500},
      {1750, 1800}}},
    {"fault chance_when", {{551, 561}, {751, 761}, {1051, 1061}, {1651, 1661}}},
    {"fault chance_while", {{101, 201}, {301, 401}, {701, 801}, {901, 1001}, {1101, 1201}, {1701, 1801}}},
};

/// All others.
const std::map<std::string, Spans> spans_by_time_and_condition{
    {"stimulus shapes", {{100, run_end}}},
    {"stimulus endless", {{0, run_end}}},
    {"stimulus line", {{200, run_end}}},
    {"stimulus steps", {{200, 500}, {700, 1000}}},
    {"stimulus pushed", {{201, 321}, {701, 821}, {1201, 1321}}},
    {"stimulus gated", {{401, 901}}},
    {"stimulus gain", {{0, run_end}}},
    {"stimulus speed", {{0, run_end}}},
    {"stimulus level", {{0, run_end}}},
    {"fault stuck_at_value", {{100, 150}}},
    {"fault stuck_at_last", {{200, 250}}},
    {"fault offset", {{300, 350}}},
    {"fault gain", {{400, 450}}},
    {"fault noise", {{500, 550}}},
    {"fault drift", {{600, 650}}},
    {"fault delay", {{700, 750}}},
    {"fault dropout", {{800, 850}}},
    {"fault partly", {{900, 950}}},
    {"fault slow", {{1000, 1100}}},
    {"fault from_the_start", {{0, run_end}}},
    {"fault at", {{110, run_end}}},
    {"fault at_for", {{120, 150}}},
    {"fault at_until", {{130, 201}}},
    {"fault every", {{150, 170}, {650, 670}, {1150, 1170}, {1650, 1670}}},
    {"fault every_times", {{200, 210}, {300, 310}, {400, 410}, {500, 510}}},
    {"fault when", {{301, run_end}}},
    {"fault when_for", {{101, 151}}},
    {"fault when_times", {{101, 111}, {301, 311}, {501, 511}}},
    {"fault when_until", {{401, 451}}},
    {"fault while", {{301, 601}, {901, 1201}, {1501, 1801}}},
    {"fault while_times", {{301, 401}, {701, 801}}},
    {"fault after_an_event", {{151, 171}}},
    {"fault after_a_while", {{421, 426}}},  // fault.at_for and stimulus.gated are read in the next tick
    {"fault sent_dropped", {{200, 250}}},
    {"fault sent_repeated", {{300, 350}}},
    {"fault sent_late", {{400, 450}}},
    {"fault sent_stuck", {{500, 550}}},
    {"fault sent_counter", {{600, 650}}},
    {"fault sent_checksum", {{700, 750}}},
    {"fault sent_short", {{800, 850}}},
    {"fault sent_flipped", {{900, 950}}},
    {"fault received_dropped", {{1000, 1050}}},
    {"fault received_repeated", {{1100, 1150}}},
    {"fault received_late", {{1200, 1250}}},
    {"fault received_stuck", {{1300, 1350}}},
    {"fault received_counter", {{1400, 1450}}},
    {"fault received_checksum", {{1500, 1550}}},
    {"fault received_short", {{1600, 1650}}},
    {"fault received_flipped", {{1700, 1750}}},
    {"fault bus_off", {{1800, 1850}}},
    {"fault silent", {{200, 300}}},
    {"fault disconnected", {{600, 700}}},
    {"fault exception", {{1000, 1100}}},
    {"fault slow_replies", {{1400, 1500}}},
    {"fault paused", {{300, 400}}},
    {"fault killed", {{1500, run_end}}},
    // By space. The front of the mover is at 13.005 m - 10 m/s t, its rear 2 m behind; what holds between two
    // ticks is computed in the later one, and read in the next.
    {"fault near", {{702, run_end}}},
    {"fault touching", {{1202, 1602}}},
    {"fault urgent", {{702, 802}}},
    {"fault inside", {{202, 602}}},
    {"fault seen", {{152, 1352}}},
};

std::map<std::string, Spans> spans_of(const Json& report) {
  std::map<std::string, Spans> spans;
  for (const auto& [list, kind] : {std::pair("stimuli", "stimulus "), {"faults", "fault "}}) {
    for (const Json& one : report[list]) {
      Spans& of_one = spans[kind + one["name"].get<std::string>()];
      for (const Json& span : one["spans"]) {
        EXPECT_EQ(span[0].get<std::int64_t>() % 1'000'000, 0) << one.dump(1);
        of_one.emplace_back(span[0].get<std::int64_t>() / 1'000'000, span[1].get<std::int64_t>() / 1'000'000);
      }
      EXPECT_EQ(one["begins"], of_one.size()) << one.dump(1);
      EXPECT_EQ(one["first_begin_ns"], 1'000'000 * of_one.front().first) << one.dump(1);
    }
  }
  return spans;
}

/// The begins and ends of stimuli, faults and parts of stimuli, as "1500 fault killed begins".
std::multiset<std::string> expected_events() {
  std::multiset<std::string> events;
  for (const auto* const spans : {&spans_by_chance, &spans_by_time_and_condition}) {
    for (const auto& [name, of_one] : *spans) {
      for (const auto& [begin_ms, end_ms] : of_one) {
        events.insert(std::to_string(begin_ms) + " " + name + " begins");
        if (end_ms != run_end) events.insert(std::to_string(end_ms) + " " + name + " ends");
      }
    }
  }
  std::int64_t begin_ms = 100;
  for (int round = 0; round < 2; ++round) {
    for (const char* part : {"step", "computed", "rising", "wave", "saw", "train", "rough"}) {
      events.insert(std::to_string(begin_ms) + " stimulus shapes: " + part + " begins");
      begin_ms += 100;
    }
  }
  return events;
}

std::multiset<std::string> events_of(const Json& report) {
  std::multiset<std::string> events;
  for (const Json& event : report["events"]) {
    std::string text = event["text"];
    if (!text.starts_with("stimulus ") && !text.starts_with("fault ")) continue;
    if (const std::size_t target = text.find("begins: "); target != std::string::npos)
      text.resize(target + std::string("begins").size());
    events.insert(std::to_string(event["time_ns"].get<std::int64_t>() / 1'000'000) + " " + text);
  }
  return events;
}

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
  for (std::int64_t ms = 0; ms < run_end; ms += 10) {
    const auto in = [ms](std::int64_t begin_ms) { return ms >= begin_ms && ms < begin_ms + 50; };
    if (in(1800)) continue;  // bus_off
    LogLine line{ms, payload_of(in(500) ? 490 : ms, in(600) ? 59 : counter)};
    ++counter;
    if (ms == 220 || ms == 230) continue;  // two of five frames, by seed 1
    if (in(400)) line.time_ms += 3;
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

Json run_all_kinds(const std::string& out, const std::vector<std::string>& more = {}) {
  const Ended ended = run_hil(joined({{"run", all_kinds_file("all_kinds.yaml"), "--out", out}, more}));
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  return read_report(out);
}

TEST(AllKinds, BeginAndEndAtTheirInstants) {
  const Folder folder;
  const Json report = run_all_kinds(folder / "out");
  std::map<std::string, Spans> expected = spans_by_chance;
  expected.insert(spans_by_time_and_condition.begin(), spans_by_time_and_condition.end());
  const std::map<std::string, Spans> spans = spans_of(report);
  for (const auto& [name, of_one] : spans)
    EXPECT_EQ(of_one, expected[name]) << name;
  EXPECT_EQ(spans.size(), expected.size());
  EXPECT_EQ(events_of(report), expected_events());

  for (const Json& expectation : report["expectations"])
    EXPECT_EQ(expectation["result"], "held") << expectation.dump(1);

  std::vector<LogLine> frames;
  for (const io::can::LoggedFrame& logged : read_can_log(folder / "out/can-car.log")) {
    const auto payload = logged.frame.payload();
    if (logged.frame.raw.can_id == 0x100)
      frames.push_back({logged.frame.wall_ns / 1'000'000, {payload.begin(), payload.end()}});
  }
  EXPECT_EQ(frames, expected_frames());
  const Json& car = report["can"][0];
  EXPECT_EQ(car["bad_checksum"], 15) << "wrong, short and flipped frames, five each";
  EXPECT_EQ(car["bad_counter"], 15)
      << "five repeated ones, five with a wrong counter, and the first ones after "
         "those that were dropped, wrong (twice), short and flipped";
  for (const Json& task : report["tasks"]) {
    const int misses = task["name"] == "slow" ? 5 : 0;
    EXPECT_EQ(task["deadline_misses"], misses) << task["name"] << ": each step of 12 ms covers two releases";
  }
  EXPECT_EQ(report["modbus"][0]["exceptions"][0]["code"], 6);
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

TEST(AllKinds, OnlyChanceFollowsFromTheSeed) {
  const Folder folder;
  std::map<std::string, Spans> spans = spans_of(run_all_kinds(folder / "out", {"--seed", "2"}));
  for (const auto& [name, of_one] : spans_by_chance)
    EXPECT_NE(spans[name], of_one) << name;
  for (const auto& [name, of_one] : spans_by_time_and_condition)
    EXPECT_EQ(spans[name], of_one) << name;
}

}  // namespace
}  // namespace hil::scenario_test
