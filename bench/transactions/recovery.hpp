#pragma once
// How long an open takes: a hundred thousand entities and ten seconds of log, of a loop that moves a hundred of them each millisecond.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_recovery(const SuiteOptions& options);

}  // namespace hil::bench
