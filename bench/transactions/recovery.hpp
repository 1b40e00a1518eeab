#pragma once
// The duration of an open: a hundred thousand entities and ten seconds of log of a loop that moves a hundred
// entities per millisecond.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_recovery(const SuiteOptions& options);

}  // namespace hil::bench
