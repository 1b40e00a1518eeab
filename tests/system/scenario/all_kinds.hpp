#pragma once
// The scenario with every kind of stimulus, fault, trigger and expectation.

#include <string>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"

namespace hil::scenario_test {

inline std::string all_kinds_file(const std::string& name) {
  return std::string(HIL_SOURCE_DIR) + "/tests/system/scenario/all_kinds/" + name;
}

}  // namespace hil::scenario_test
