#pragma once
// The memory of structures, compared with Embree's.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// bytes_per_triangle: one mesh with its structure, everything that queries need. bytes_per_entity: moving
/// entities with their structure for one version, without meshes. Embree's figures come from its memory
/// monitor.
std::vector<Figure> measure_memory(const SuiteOptions& options);

}  // namespace hil::bench
