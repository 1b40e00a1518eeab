#pragma once
// The program of a suite: its families of figures, chosen by name on the command line.

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

/// `program [--json] [--tiny] [--awake] [FAMILY...]`: prints a line for each figure of the families named, or of all. --awake: the
/// processors are kept out of sleep meanwhile, as by a run with SCHED_FIFO. Returns the exit code: 1 when a family throws or the
/// processors can not be kept awake, 2 for an argument that is not known.
int run_suite(const std::string& program, std::span<const Family> families, std::string (*device)(), int argc,
              char** argv);

}  // namespace hil::bench
