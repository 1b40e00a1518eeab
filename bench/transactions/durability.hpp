#pragma once
// The cost of the log for commits: the same commits with a log in async mode and without one, in alternation.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_durability(const SuiteOptions& options);

}  // namespace hil::bench
