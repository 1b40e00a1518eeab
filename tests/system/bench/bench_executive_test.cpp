// The parts of the executive's benchmark, and its program in tiny mode.

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/executive/cyclictest.hpp"
#include "bench/figure/figure.hpp"
#include "tests/paths.h"

namespace hil::bench {
namespace {

struct Output {
  int exit_code = 0;
  std::string text;
  std::vector<std::string> lines;
};

Output run_program(const std::string& command) {
  Output output;
  FILE* const pipe = popen(command.c_str(), "r");
  std::array<char, 4096> line{};
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) {
    output.lines.emplace_back(line.data());
    output.text += output.lines.back();
  }
  const int status = pclose(pipe);
  output.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return output;
}

TEST(Cyclictest, OutputIsParsedToQuantiles) {
  const std::string printed =
      "# /dev/cpu_dma_latency set to 0us\n# Histogram\n000000 000000\n001500 000050\n002500 000048\n009000 "
      "000001\n"
      "# Total: 000000099\n# Min Latencies: 01500\n# Max Latencies: 1371384\n# Histogram Overflows: 00001\n";
  const WakeupLatency latency = parse_cyclictest(printed);
  EXPECT_EQ(latency.samples, 100U);
  EXPECT_DOUBLE_EQ(latency.p50_us, 1.5);
  EXPECT_DOUBLE_EQ(latency.p99_us, 9.0);
  EXPECT_DOUBLE_EQ(latency.max_us, 1371.384);
  EXPECT_EQ(latency.beyond_1_ms, 1U);
}

TEST(Cyclictest, QuantileBeyondTheHistogramIsTheMaximum) {
  const WakeupLatency latency =
      parse_cyclictest("000010 000001\n# Max Latencies: 2000000\n# Histogram Overflows: 00009\n");
  EXPECT_DOUBLE_EQ(latency.p50_us, 2000.0);
}

TEST(Cyclictest, OtherTextIsRefused) {
  EXPECT_THROW(parse_cyclictest("sh: 1: cyclictest: not found\n"), std::runtime_error);
}

TEST(Figure, RatioAboveOneIsBetter) {
  Figure figure{"f", 2.0, "us", "peer 1", 3.0, Better::lower, 1};
  EXPECT_DOUBLE_EQ(figure.ratio().value(), 1.5);
  figure.better = Better::higher;
  EXPECT_DOUBLE_EQ(figure.ratio().value(), 2.0 / 3.0);
  figure.theirs.reset();
  EXPECT_FALSE(figure.ratio().has_value());
}

TEST(Figure, MedianOfOddAndEvenCounts) {
  EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({4.0, 1.0, 2.0, 3.0}), 2.5);
}

TEST(BenchExecutive, TinyModePrintsOneJsonLinePerFigure) {
  const Output output = run_program(std::string(HIL_BENCH_EXECUTIVE) + " --tiny --json");
  ASSERT_EQ(output.exit_code, 0);
  const std::array<const char*, 7> names = {
      "wakeup_p50",      "wakeup_p99",   "tick_overhead_10_tasks", "bench_tick",
      "block_10_states", "judge_frames", "recording_200_signals"};
  ASSERT_EQ(output.lines.size(), names.size()) << output.text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto line = nlohmann::json::parse(output.lines[i]);
    ASSERT_EQ(line.size(), 9U);
    EXPECT_EQ(line.at("name"), names[i]);
    EXPECT_EQ(line.at("unit"), "us");
    EXPECT_GT(line.at("ours").get<double>(), 0.0);
    EXPECT_FALSE(line.at("device").get<std::string>().empty());
    EXPECT_GE(line.at("samples").get<int>(), 150);
    if (i >= 2) {
      EXPECT_TRUE(line.at("peer").is_null());
      EXPECT_TRUE(line.at("theirs").is_null());
      EXPECT_TRUE(line.at("ratio").is_null());
    } else {
      EXPECT_TRUE(line.at("peer").get<std::string>().starts_with("cyclictest "));
      EXPECT_NEAR(line.at("ratio").get<double>(),
                  line.at("theirs").get<double>() / line.at("ours").get<double>(), 1e-9);
    }
  }
}

TEST(BenchExecutive, UnknownSuiteOrArgumentIsRefused) {
  const Output suite = run_program(std::string(HIL_SOURCE_DIR) + "/tools/bench nonsense --json 2>&1");
  EXPECT_EQ(suite.exit_code, 2);
  EXPECT_NE(suite.text.find("unknown suite 'nonsense'; suites: "), std::string::npos) << suite.text;
  EXPECT_NE(suite.text.find("executive"), std::string::npos);
  const Output argument = run_program(std::string(HIL_BENCH_EXECUTIVE) + " --fast 2>&1");
  EXPECT_EQ(argument.exit_code, 2);
  EXPECT_NE(argument.text.find("unknown argument '--fast'; known: --json, --tiny"), std::string::npos);
}

}  // namespace
}  // namespace hil::bench
