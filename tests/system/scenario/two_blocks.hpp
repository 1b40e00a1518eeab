#pragma once
// A small scenario whose history is known by a formula.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {

using Json = nlohmann::json;

/// A block of 2 m that moves along x from 20 m with -3 m/s, and a post at the origin.
inline constexpr const char* two_blocks = R"(
scenario: two_blocks
base_rate: 100 Hz
duration: 4 s
clock: virtual
world:
  entities:
    - {name: post, shape: {box: [1 m, 1 m, 1 m]}, mask: [fixed]}
    - {name: block, shape: {box: [2 m, 2 m, 2 m]}, position: [20 m, 0 m, 0 m], velocity: [-3 m/s, 0 m/s, 0 m/s], mask: [moving]}
)";

/// The JSON that a successful command prints.
inline Json answer(const std::vector<std::string>& words) {
  const Ended ended = run_hil(words);
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  Json json = Json::parse(ended.output, nullptr, false);
  EXPECT_FALSE(json.is_discarded()) << ended.output;
  return json;
}

}  // namespace hil::scenario_test
