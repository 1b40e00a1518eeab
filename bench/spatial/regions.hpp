#pragma once
// Boxes that ask for the entities they touch, beside Boost.Geometry's R*-tree.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// region_box_entities: ids, by ascending index on our side; and region_box_entities_device by the device's
/// own time alone. Throws std::runtime_error when the sides disagree.
std::vector<Figure> measure_regions(const SpatialOptions& options);

}  // namespace hil::bench
