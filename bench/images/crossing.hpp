#pragma once
// An image of the crossing of configs/crossing in real-time mode, beside the path tracer.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_crossing(const SuiteOptions& options);

}  // namespace hil::bench
