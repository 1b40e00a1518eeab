// Every kind of stimulus, fault and trigger, active in one run: the exact instants of each.

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/system/scenario/all_kinds.hpp"

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
    {"fault by_identifier", {{100, 150}}},
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
    {"fault crossed", {{602, run_end}}},
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

/// The begins and ends of stimuli, faults and parts of stimuli, as "1500 fault killed begins", and what
/// devices and processes do: the base thread finds it in the tick after the exchange.
std::multiset<std::string> expected_events() {
  std::multiset<std::string> events{"201 Modbus unit plc is lost",
                                    "301 Modbus unit plc works again",
                                    "601 Modbus unit plc is lost",
                                    "701 Modbus unit plc works again",
                                    "1001 Modbus unit plc has a fault",
                                    "1101 Modbus unit plc works again",
                                    "1500 process spare was ended by signal 9 (Killed)",
                                    "1801 CAN bus car is lost",
                                    "1851 CAN bus car works again"};
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
    if (const std::size_t target = text.find("begins: "); target != std::string::npos)
      text.resize(target + std::string("begins").size());
    events.insert(std::to_string(event["time_ns"].get<std::int64_t>() / 1'000'000) + " " + text);
  }
  return events;
}

TEST(AllKindsInstants, AreThoseOfTheScenario) {
  const Folder folder;
  const Json report = run_all_kinds(folder / "out");
  std::map<std::string, Spans> expected = spans_by_chance;
  expected.insert(spans_by_time_and_condition.begin(), spans_by_time_and_condition.end());
  const std::map<std::string, Spans> spans = spans_of(report);
  for (const auto& [name, of_one] : spans)
    EXPECT_EQ(of_one, expected[name]) << name;
  EXPECT_EQ(spans.size(), expected.size());
  EXPECT_EQ(events_of(report), expected_events());
}

TEST(AllKindsInstants, FollowFromTheSeedWhereTheyHaveAProbability) {
  const Folder folder;
  // A seed with which each of the spans by chance differs from those of the scenario's seed.
  std::map<std::string, Spans> spans = spans_of(run_all_kinds(folder / "out", {"--seed", "3"}));
  for (const auto& [name, of_one] : spans_by_chance)
    EXPECT_NE(spans[name], of_one) << name;
  for (const auto& [name, of_one] : spans_by_time_and_condition)
    EXPECT_EQ(spans[name], of_one) << name;
}

}  // namespace
}  // namespace hil::scenario_test
