#pragma once
// How long a small urgent transaction waits while the device works on a large batch of lower importance.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_urgent(const SuiteOptions& options);

}  // namespace hil::bench
