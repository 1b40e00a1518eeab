#pragma once
// From submit to answer: one entity moves and 64 rays are asked, in a world of 10,000.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_answers(const SuiteOptions& options);

}  // namespace hil::bench
