#pragma once
// How long a small transaction waits while the device works on a large batch of lower importance.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_preemption(const SuiteOptions& options);

}  // namespace hil::bench
