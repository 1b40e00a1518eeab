#pragma once
// The error of distance fields by their memory, for three ways to blend the vertices of a cell.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

/// For each mesh and for cells of 1/8 to 1/512 of the diagonal `field_error_<mesh>_<cells>`: the 99th
/// percentile of the blend's error at points within two cells of the surface, in parts per million of the
/// diagonal, compared with that of order 0 (distances alone) and, as `..._planes`, with that of blended
/// planes. Then `field_memory_<mesh>`: by which factor the memory of order 0, with four bytes for a vertex
/// instead of eight, is larger for an error of 1/500 of the diagonal; interpolated between the cells above.
std::vector<Figure> measure_field_memory(const SuiteOptions& options);

}  // namespace hil::bench
