// In real time a fault and a stimulus begin within one tick of their instants, by the run's clock and by the
// wall clock.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <map>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

using Json = nlohmann::json;

constexpr const char* realtime_scenario = R"(
scenario: injection in real time
base_rate: 1 kHz
duration: 400 ms
tasks:
  - {module: source, type: block, rate: 1 kHz, parameters: {outputs: {x: time * 1 m/s}}}
  - module: sink
    type: block
    rate: 1 kHz
    inputs: {x: source.x}
    parameters: {inputs: {x: m, level: m}, outputs: {sum: x + level}}
stimuli:
  - {name: step, drives: sink.level, sequence: [{hold: 1 m}], at: 100 ms}
faults:
  - {name: stuck, signal: source.x, stuck: last, at: 200 ms, for: 100 ms}
)";

constexpr std::int64_t period_ns = 1'000'000;

/// The first tick that is not before `time_ns` and was not skipped.
std::int64_t first_tick(const Json& report, std::int64_t time_ns) {
  for (const Json& skip : report["watchdog"]) {
    const std::int64_t begin_ns = skip["time_ns"];
    const std::int64_t end_ns = begin_ns + period_ns * std::atoll(skip["text"].get<std::string>().c_str());
    if (time_ns >= begin_ns && time_ns < end_ns) time_ns = end_ns;
  }
  return time_ns;
}

/// By the wall clock, after the first tick was due: when stimuli and faults of a tick had been applied.
std::map<std::int64_t, double> applied_us(const std::string& trace_file) {
  std::map<std::int64_t, double> applied;
  const Json trace = Json::parse(read_text(trace_file));
  for (const Json& event : trace["traceEvents"]) {
    if (event["name"] == "latch inputs" && event["ph"] == "X")
      applied[event["args"]["tick"]] = event["ts"].get<double>() + event["dur"].get<double>();
  }
  return applied;
}

TEST(InjectionInRealTime, BeginsWithinOneTick) {
  const Folder folder;
  write_text(folder / "s.yaml", realtime_scenario);
  std::map<std::string, std::int64_t> instants_ns{{"stimulus step begins", 100'000'000},
                                                  {"fault stuck begins", 200'000'000},
                                                  {"fault stuck ends", 300'000'000}};
  // A machine that is busy at an instant may skip its tick, or begin it late; each instant has five attempts.
  for (int attempt = 0; attempt < 5 && !instants_ns.empty(); ++attempt) {
    const Ended ended =
        run_hil(joined({{"run", folder / "s.yaml", "--out", folder / "out"}, relaxed_timing()}));
    ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
    const Json report = read_report(folder / "out");
    ASSERT_EQ(report["watchdog_not_listed"], 0);
    const auto applied = applied_us(folder / "out/trace.json");
    std::map<std::string, std::int64_t> begun_ns;
    for (const Json& event : report["events"]) {
      const std::string text = event["text"];
      begun_ns[text.substr(0, text.find(':'))] = event["time_ns"];
    }
    ASSERT_EQ(begun_ns.size(), 3u) << report["events"].dump(1);
    // By the run's clock, whatever the machine does.
    EXPECT_EQ(begun_ns["stimulus step begins"], first_tick(report, 100'000'000));
    EXPECT_EQ(begun_ns["fault stuck begins"], first_tick(report, 200'000'000));
    EXPECT_EQ(begun_ns["fault stuck ends"], first_tick(report, begun_ns["fault stuck begins"] + 100'000'000));
    // By the wall clock.
    std::erase_if(instants_ns, [&](const auto& instant) {
      const auto& [text, at_ns] = instant;
      if (begun_ns[text] != at_ns) return false;
      const double late_us = applied.at(at_ns / period_ns) - 1e-3 * static_cast<double>(at_ns);
      EXPECT_GT(late_us, 0.0) << text;
      return late_us < 1e-3 * period_ns;
    });
  }
  for (const auto& [text, at_ns] : instants_ns)
    ADD_FAILURE() << "'" << text << "' was never within one tick of " << at_ns << " ns";
}

TEST(InjectionInRealTime, SkippedTicksNameTheFaultThatTheScenarioWants) {
  const Folder folder;
  write_text(folder / "s.yaml",
             std::string(realtime_scenario) +
                 "  - {name: slow, task: source, takes_longer: 30 ms, at: 320 ms, for: 20 ms}\n");
  const Ended ended =
      run_hil(joined({{"run", folder / "s.yaml", "--out", folder / "out"}, relaxed_timing()}));
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  const Json report = read_report(folder / "out");
  ASSERT_EQ(report["faults"][1]["spans"].size(), 1U) << report["faults"].dump();
  const std::int64_t begin_ns = report["faults"][1]["spans"][0][0],
                     end_ns = report["faults"][1]["spans"][0][1];
  bool is_found = false;
  for (const Json& ticks : report["watchdog"]) {
    const std::int64_t time_ns = ticks["time_ns"];
    const bool is_wanted = time_ns >= begin_ns && time_ns <= end_ns + 30'000'000;
    EXPECT_EQ(ticks["fault"], is_wanted ? "slow" : "") << ticks.dump();
    if (!is_wanted) continue;
    is_found = true;
    EXPECT_NE(
        ticks["text"].get<std::string>().find("; fault slow: task source with steps that take 30 ms longer"),
        std::string::npos)
        << ticks.dump();
  }
  EXPECT_TRUE(is_found);
}

}  // namespace
}  // namespace hil::scenario_test
