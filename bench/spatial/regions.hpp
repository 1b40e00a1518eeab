#pragma once
// Box regions that list the entities, or the triangles of a mesh, that they touch, compared with
// Boost.Geometry's R*-tree.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// region_box_entities and region_box_triangles, in ascending order on our side, and the same with _device by
/// the device's own time. Throws std::runtime_error when the results disagree.
std::vector<Figure> measure_regions(const SuiteOptions& options);

}  // namespace hil::bench
