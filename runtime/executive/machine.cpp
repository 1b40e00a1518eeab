#include "runtime/executive/machine.hpp"

#include <algorithm>
#include <charconv>
#include <ctime>
#include <filesystem>
#include <fstream>

namespace hil::executive {
namespace {

namespace fs = std::filesystem;

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::optional<std::int64_t> whole_number(const std::string& text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end == text.data()) return std::nullopt;
  return value;
}

std::vector<std::string> governors_below(const fs::path& cpus) {
  std::vector<std::string> governors;
  std::error_code none;
  for (const fs::directory_entry& cpu : fs::directory_iterator(cpus, none)) {
    std::string governor = first_line(cpu.path() / "cpufreq" / "scaling_governor");
    if (!governor.empty()) governors.push_back(std::move(governor));
  }
  std::sort(governors.begin(), governors.end());
  governors.erase(std::unique(governors.begin(), governors.end()), governors.end());
  return governors;
}

}  // namespace

MachineState read_machine_state(const std::string& root) {
  MachineState facts;
  facts.preempt_rt = first_line(root + "/sys/kernel/realtime") == "1" ||
                     first_line(root + "/proc/version").find("PREEMPT_RT") != std::string::npos;
  timespec resolution{};
  clock_getres(CLOCK_MONOTONIC, &resolution);
  facts.timer_resolution_ns =
      static_cast<std::int64_t>(resolution.tv_sec) * 1'000'000'000 + resolution.tv_nsec;
  facts.frequency_governors = governors_below(root + "/sys/devices/system/cpu");
  facts.rt_runtime_us = whole_number(first_line(root + "/proc/sys/kernel/sched_rt_runtime_us"));
  facts.rt_period_us = whole_number(first_line(root + "/proc/sys/kernel/sched_rt_period_us")).value_or(0);
  return facts;
}

std::vector<std::string> timing_limits(const MachineState& facts, bool fifo) {
  std::vector<std::string> limits;
  if (!facts.preempt_rt) limits.emplace_back("the kernel is not PREEMPT_RT: wake-up latency has no bound");
  if (facts.timer_resolution_ns > 1'000) {
    limits.push_back("no high-resolution timers: the clock's resolution is " +
                     std::to_string(facts.timer_resolution_ns) + " ns");
  }
  for (const std::string& governor : facts.frequency_governors) {
    if (governor == "performance") continue;
    limits.push_back("CPU frequency scaling is on (governor " + governor + "): set it to performance");
  }
  if (fifo && facts.rt_runtime_us && *facts.rt_runtime_us >= 0) {
    limits.push_back("RT throttling: real-time threads get " + std::to_string(*facts.rt_runtime_us) +
                     " of each " + std::to_string(facts.rt_period_us) +
                     " us (sched_rt_runtime_us; -1 lifts it)");
  }
  return limits;
}

}  // namespace hil::executive
