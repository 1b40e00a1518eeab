#pragma once
// The scenario with every kind of stimulus, fault, trigger and expectation.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {

inline std::string all_kinds_file(const std::string& name) {
  return std::string(HIL_SOURCE_DIR) + "/tests/system/scenario/all_kinds/" + name;
}

/// Runs it, and returns its report. Every expectation has to hold.
inline nlohmann::json run_all_kinds(const std::string& out, const std::vector<std::string>& more = {}) {
  const Ended ended = run_hil(joined({{"run", all_kinds_file("all_kinds.yaml"), "--out", out}, more}));
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  return read_report(out);
}

}  // namespace hil::scenario_test
