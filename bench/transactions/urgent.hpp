#pragma once
// How long a small urgent transaction waits for a device that is at work on a large batch of somebody else.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_urgent(const SuiteOptions& options);

}  // namespace hil::bench
