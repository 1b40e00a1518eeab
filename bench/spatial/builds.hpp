#pragma once
// Builds and updates of structures, compared with Embree. The query families compare the results.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// tlas_rebuild_10k, tlas_rebuild_100k: every instance is at a new place. tlas_refit_10k: every instance has
/// moved a little. Each with a figure `_device`. Measured from rows and matrices in memory to a structure
/// that can be queried. blas_build_bunny: Database::add_geometry of HIL_TEST_DATA's
/// meshes/stanford-bunny.obj, or of another body of its size. blas_refit_bunny: the same as deforming
/// geometry, from positions in memory to a structure that can be queried; with a figure `_device`.
std::vector<Figure> measure_builds(const SuiteOptions& options);

}  // namespace hil::bench
