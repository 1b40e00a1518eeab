#pragma once
// The main program of a suite. The command line selects families of figures by name.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bench/figure/figure.hpp"

namespace hil::bench {

struct SuiteOptions {
  bool tiny = false;  ///< only shows that it works
};

struct Family {
  std::string_view name;
  std::vector<Figure> (*measure)(const SuiteOptions& options);
};

/// `program [--json] [--tiny] [--awake] [FAMILY...]`: prints a line for each figure of the named families, or
/// of all. --awake keeps the processors out of sleep states, as a run with SCHED_FIFO does. Returns the exit
/// code: 1 when a family throws or the processors can not be kept awake, 2 for an unknown argument.
int run_suite(const std::string& program, std::span<const Family> families, std::string (*device)(), int argc,
              char** argv);

}  // namespace hil::bench
