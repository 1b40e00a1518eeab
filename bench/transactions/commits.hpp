#pragma once
// Commits of rows only: one after the other, many queued at once, a thousand rows in one.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_commits(const SuiteOptions& options);

}  // namespace hil::bench
