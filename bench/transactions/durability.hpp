#pragma once
// What the log costs those who commit: the same commits with a log in async mode and without one, in turns.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_durability(const SuiteOptions& options);

}  // namespace hil::bench
