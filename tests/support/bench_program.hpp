#pragma once
// Runs the program of a benchmark suite and checks its output.

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

namespace hil::bench {

struct Output {
  int exit_code = 0;
  std::string text;
  std::vector<std::string> lines;
};

inline Output run_program(const std::string& command) {
  Output output;
  FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  std::array<char, 4096> line{};
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) {
    output.lines.emplace_back(line.data());
    output.text += output.lines.back();
  }
  const int status = pclose(pipe);
  output.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return output;
}

struct Expected {
  const char* name;
  const char* unit;
  const char* peer;  ///< the begin of its name; empty: none
};

/// One line of JSON for each figure, in this order.
inline void expect_figures(const Output& output, std::span<const Expected> figures) {
  ASSERT_EQ(output.exit_code, 0) << output.text;
  ASSERT_EQ(output.lines.size(), figures.size()) << output.text;
  for (std::size_t i = 0; i < output.lines.size(); ++i) {
    const Expected& expected = figures[i];
    const auto line = nlohmann::json::parse(output.lines[i]);
    ASSERT_EQ(line.size(), 9U);
    EXPECT_EQ(line.at("name"), expected.name);
    EXPECT_EQ(line.at("unit"), expected.unit);
    EXPECT_GT(line.at("ours").get<double>(), 0.0) << expected.name;
    const std::string better = line.at("better");
    EXPECT_TRUE(better == "lower" || better == "higher") << better;
    EXPECT_FALSE(line.at("device").get<std::string>().empty());
    EXPECT_GE(line.at("samples").get<int>(), 1);
    if (*expected.peer == '\0') {
      EXPECT_TRUE(line.at("peer").is_null()) << expected.name;
      EXPECT_TRUE(line.at("ratio").is_null()) << expected.name;
    } else {
      EXPECT_TRUE(line.at("peer").get<std::string>().starts_with(expected.peer)) << expected.name;
      EXPECT_GT(line.at("ratio").get<double>(), 0.0) << expected.name;
    }
  }
}

}  // namespace hil::bench
