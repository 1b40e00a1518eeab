#pragma once
// First hits of an image of a scene with many bodies: by the rasteriser, beside those that are traced.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_first_hits(const SuiteOptions& options);

}  // namespace hil::bench
