#include "bench/executive/bench_tick.hpp"

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/figure/figure.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/run/session.hpp"
#include "runtime/run/wiring.hpp"

namespace hil::bench {
namespace {

constexpr int plants = 20, always_expectations = 20, reactions = 10;

/// A folder that is removed at the end.
struct TemporaryFolder {
  std::string path = (std::filesystem::temp_directory_path() / "hil-bench-tick-XXXXXX").string();
  TemporaryFolder() {
    if (::mkdtemp(path.data()) == nullptr) throw std::runtime_error("no temporary folder can be made");
  }
  ~TemporaryFolder() {
    std::error_code error;
    std::filesystem::remove_all(path, error);
  }
};

/// Each plant reads the level of the one before it, through a fault.
std::string scenario_text(std::uint64_t ticks) {
  std::string text = "scenario: bench_tick\nbase_rate: 1 kHz\nduration: " + std::to_string(ticks) +
                     " ms\nrecording: true\nrealtime: {scheduler: fifo, max_lost: 100 %}\ntasks:\n";
  const auto number = [](int i) { return std::to_string(i); };
  for (int i = 0; i < plants; ++i) {
    text += "  - module: plant" + number(i) +
            "\n    type: block\n    rate: 1 kHz\n    inputs: {before: plant" +
            number((i + plants - 1) % plants) +
            ".level}\n    parameters:\n      inputs: {inflow: l/s, before: m}\n      states:\n"
            "        level: {initial: 1 m, derivative: (filtered - drain) / 0.5 m2, min: 0, max: 2 m}\n"
            "        filtered: {initial: 0 l/s, derivative: (inflow - filtered) / 0.3 s}\n"
            "        memory: {initial: 1 m, derivative: (before - memory) / 1 s}\n"
            "      variables: {drain: 12 cm2 * sqrt(2 * 9.81 m/s2 * level)}\n";
  }
  text += "stimuli:\n";
  for (int i = 0; i < plants; ++i)
    text += "  - {name: s" + number(i) + ", drives: plant" + number(i) +
            ".inflow, sequence: [{sine: {mean: 5 l/s, amplitude: 2 l/s, period: 1 s}}]}\n";
  text += "faults:\n";
  for (int i = 0; i < plants; ++i)
    text += "  - {name: f" + number(i) + ", signal: plant" + number(i) + ".level, offset: 1 cm}\n";
  text += "expectations:\n";
  for (int i = 0; i < always_expectations; ++i)
    text += "  - {name: a" + number(i) + ", always: plant" + number(i) + ".level < 1.9 m}\n";
  for (int i = 0; i < reactions; ++i)
    text += "  - {name: r" + number(i) + ", reaction: {when: plant" + number(i) +
            ".level > 0.1 m, then: plant" + number(i) + ".memory > 0.1 m, within: 100 ms}}\n";
  return text;
}

/// The time that a tick of one run works, in microseconds.
double tick_us(const TemporaryFolder& folder, std::uint64_t ticks) {
  const std::string file = folder.path + "/bench_tick.yaml";
  std::ofstream(file) << scenario_text(ticks);
  config::Diagnostics diagnostics;
  auto scenario = config::load_scenario(file, {}, run::scenario_types(), diagnostics);
  auto wiring = scenario ? run::wire(*scenario, diagnostics) : std::nullopt;
  if (!wiring) throw std::runtime_error(diagnostics.to_text());
  run::SessionOptions options;
  options.directory = folder.path;
  const std::atomic<bool> stop_requested{false};
  const report::RunRecord record = run::run_session(std::move(*wiring), options, stop_requested).record;
  if (record.verdict != report::Verdict::passed) throw std::runtime_error("bench_tick: " + record.reason);
  std::int64_t worked_ns = 0;
  for (const report::BaseStage& stage : record.base_stages) {
    if (stage.name != "idle" && stage.name != "wake-up latency") worked_ns += stage.total_ns;
  }
  return static_cast<double>(worked_ns) * 1e-3 / static_cast<double>(record.ticks);
}

}  // namespace

BenchTick measure_bench_tick(int rounds, std::uint64_t ticks_per_round) {
  const TemporaryFolder folder;
  BenchTick tick;
  std::vector<double> rounds_us;
  for (int round = 0; round < rounds; ++round) {
    rounds_us.push_back(tick_us(folder, ticks_per_round));
    tick.ticks += ticks_per_round;
  }
  tick.median_us = median(std::move(rounds_us));
  return tick;
}

}  // namespace hil::bench
