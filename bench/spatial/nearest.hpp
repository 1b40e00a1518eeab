#pragma once
// Nearest queries, compared with Embree's point query and nanoflann's KD-tree.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// nearest_triangle_k1: points around one static mesh. nearest_entity_k8: the eight nearest of 100,000
/// centres. Each with a figure `_device`. Throws std::runtime_error when the results disagree.
std::vector<Figure> measure_nearest(const SuiteOptions& options);

}  // namespace hil::bench
