#pragma once
// What is nearest to points, beside Embree's point query and nanoflann's KD-tree.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// nearest_triangle_k1: points about one standing mesh. nearest_entity_k8: the eight nearest of 100,000
/// centres. Each with a figure `_device`. Throws std::runtime_error when the sides disagree.
std::vector<Figure> measure_nearest(const SuiteOptions& options);

}  // namespace hil::bench
