#pragma once
// Latency from submit to results: one entity moves and 64 rays are traced, in a world of 10,000 entities.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_answers(const SuiteOptions& options);

}  // namespace hil::bench
