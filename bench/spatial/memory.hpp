#pragma once
// What structures take in memory, beside Embree's.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// bytes_per_triangle: of one mesh with its structure, all that answering needs. bytes_per_entity: of moving
/// entities with their structure for one version, without meshes. Embree's by what its memory monitor reports.
std::vector<Figure> measure_memory(const SuiteOptions& options);

}  // namespace hil::bench
