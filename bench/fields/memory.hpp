#pragma once
// The error of distance fields over their memory, for three ways to blend the vertices of a cell.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

/// For each mesh and for cells of 1/8 to 1/512 of the diagonal `field_error_<mesh>_<cells>`: the error of the
/// blend in use at the 99th percentile, in parts per million of the diagonal, at points within two cells of
/// the surface, beside that of order 0 (distances alone) and, as `..._planes`, beside that of blended planes.
/// Then `field_memory_<mesh>`: how much more memory order 0 takes for an error of 1/500 of the diagonal, with
/// four bytes for a vertex instead of eight; both interpolated between the cells above.
std::vector<Figure> measure_field_memory(const SuiteOptions& options);

}  // namespace hil::bench
