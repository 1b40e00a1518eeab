#include "bench/executive/cyclictest.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace hil::bench {
namespace {

struct Output {
  int status = 0;
  std::string text;
};

Output run_program(const std::string& command) {
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("can not start a shell for: " + command);
  Output output;
  std::array<char, 65'536> part{};
  for (std::size_t got = 0; (got = std::fread(part.data(), 1, part.size(), pipe)) > 0;)
    output.text.append(part.data(), got);
  output.status = pclose(pipe);
  return output;
}

struct Histogram {
  std::vector<std::pair<std::int64_t, std::uint64_t>> filled;  ///< latency in ns, how often
  std::uint64_t total = 0;                                     ///< with those past the last bucket
  std::uint64_t overflows = 0;
  std::int64_t max_ns = 0;
};

Histogram read_histogram(const std::string& printed) {
  Histogram histogram;
  std::istringstream lines(printed);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# Max Latencies:")) histogram.max_ns = std::strtoll(line.c_str() + 16, nullptr, 10);
    if (line.starts_with("# Histogram Overflows:"))
      histogram.overflows = std::strtoull(line.c_str() + 22, nullptr, 10);
    if (line.empty() || line[0] < '0' || line[0] > '9') continue;
    char* rest = nullptr;
    const std::int64_t latency_ns = std::strtoll(line.c_str(), &rest, 10);
    const std::uint64_t count = std::strtoull(rest, nullptr, 10);
    if (count == 0) continue;
    histogram.filled.emplace_back(latency_ns, count);
    histogram.total += count;
  }
  histogram.total += histogram.overflows;
  return histogram;
}

double quantile_us(const Histogram& histogram, double share) {
  const auto rank = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(histogram.total)));
  std::uint64_t seen = 0;
  for (const auto& [latency_ns, count] : histogram.filled) {
    seen += count;
    if (seen >= rank) return static_cast<double>(latency_ns) / 1e3;
  }
  return static_cast<double>(histogram.max_ns) / 1e3;
}

}  // namespace

std::string cyclictest_version() {
  const Output output = run_program("cyclictest --help");
  const std::string mark = "cyclictest V ";
  const std::size_t at = output.text.find(mark);
  if (at == std::string::npos) throw std::runtime_error("cyclictest not found: install the package rt-tests");
  const std::size_t begin = at + mark.size();
  return "cyclictest " + output.text.substr(begin, output.text.find_first_of(" \n", begin) - begin);
}

WakeupLatency run_cyclictest(const CyclictestOptions& options) {
  const std::string policy =
      options.fifo_priority > 0 ? "-p " + std::to_string(options.fifo_priority) : "--policy=other";
  const std::string command = "cyclictest -q -m -t 1 -N -h 1000000 " + policy + " -i " +
                              std::to_string(options.period_us) + " -l " + std::to_string(options.ticks);
  const Output output = run_program(command);
  if (output.status != 0) throw std::runtime_error(command + " failed: " + output.text.substr(0, 400));
  return parse_cyclictest(output.text);
}

WakeupLatency parse_cyclictest(const std::string& printed) {
  const Histogram histogram = read_histogram(printed);
  if (histogram.total == 0)
    throw std::runtime_error("cyclictest printed no histogram: " + printed.substr(0, 400));
  WakeupLatency latency;
  latency.p50_us = quantile_us(histogram, 0.5);
  latency.p99_us = quantile_us(histogram, 0.99);
  latency.max_us = static_cast<double>(histogram.max_ns) / 1e3;
  latency.samples = histogram.total;
  latency.beyond_1_ms = histogram.overflows;
  return latency;
}

}  // namespace hil::bench
