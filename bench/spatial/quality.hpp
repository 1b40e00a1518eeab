#pragma once
// The quality of BLAS trees for rays, compared with Embree's.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// blas_sah_cost_NAME: the cost of a tree by tree_cost.hpp, compared with that of Embree's builder of quality
/// MEDIUM; blas_sah_cost_NAME_split: compared with quality HIGH, which splits triangles, as ours does not.
std::vector<Figure> measure_quality(const SuiteOptions& options);

}  // namespace hil::bench
