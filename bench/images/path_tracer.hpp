#pragma once
// Rays a second inside the path tracer, beside the same number of like rays as queries.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_path_tracer(const SuiteOptions& options);

}  // namespace hil::bench
