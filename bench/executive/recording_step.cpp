#include "bench/executive/recording_step.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bench/figure/figure.hpp"
#include "runtime/recording/recorder.hpp"

namespace hil::bench {
namespace {

constexpr std::int64_t period_ns = 1'000'000;
constexpr int modules = 10, signals_per_module = 20;

/// A file that is removed at the end.
struct TemporaryFile {
  std::string path = (std::filesystem::temp_directory_path() / "hil-bench-recording-XXXXXX").string();
  TemporaryFile() {
    const int descriptor = ::mkstemp(path.data());
    if (descriptor < 0) throw std::runtime_error("no temporary file can be made");
    std::filesystem::resize_file(path, 0);
  }
  ~TemporaryFile() {
    std::error_code error;
    std::filesystem::remove(path, error);
  }
};

}  // namespace

RecordingCost measure_recording(int rounds, std::uint64_t ticks_per_round) {
  signals::SignalTable table;
  std::vector<signals::SignalId> all;
  for (int module = 0; module < modules; ++module) {
    const std::string name = "module" + std::to_string(module);
    for (int i = 0; i < signals_per_module; ++i)
      all.push_back(
          table.add({.name = name + ".x" + std::to_string(i), .unit = "m", .writer = "module " + name}));
  }
  const TemporaryFile file;
  recording::Recorder recorder({.file = file.path,
                                .max_bytes = std::uint64_t{1} << 34,
                                .virtual_clock = false,
                                .frame_buses = {},
                                .about_run = {}},
                               table, all);
  RecordingCost cost;
  std::vector<double> rounds_us;
  double value = 0.5;
  for (int round = 0; round < rounds; ++round) {
    std::chrono::duration<double, std::micro> took{};
    const auto round_begin = std::chrono::steady_clock::now();
    for (std::uint64_t i = 0; i < ticks_per_round; ++i) {
      const std::int64_t time_ns = static_cast<std::int64_t>(cost.ticks++) * period_ns;
      for (const signals::SignalId signal : all)
        table.write(signal, value = 3.9 * value * (1.0 - value), time_ns);
      const auto begin = std::chrono::steady_clock::now();
      recorder.take(table, time_ns);
      took += std::chrono::steady_clock::now() - begin;
      std::this_thread::sleep_until(round_begin + std::chrono::nanoseconds(period_ns) * (i + 1));
    }
    rounds_us.push_back(took.count() / static_cast<double>(ticks_per_round));
  }
  if (const std::uint64_t dropped = recorder.close({}, {}).dropped; dropped > 0)
    throw std::runtime_error("the recording dropped " + std::to_string(dropped) + " messages");
  cost.median_us = median(std::move(rounds_us));
  return cost;
}

}  // namespace hil::bench
