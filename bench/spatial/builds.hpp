#pragma once
// Structures, built and brought up to date, beside Embree's. What they answer is compared by the families that
// ask rays.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// tlas_rebuild_10k, tlas_rebuild_100k: every instance stands somewhere else. tlas_refit_10k: every instance has
/// moved a little. Each with a figure `_device`. From rows and matrices in memory to a structure that can be
/// asked.
/// blas_build_bunny: Database::add_geometry of HIL_TEST_DATA's meshes/stanford-bunny.obj, or of another body
/// of its size. blas_refit_bunny: the same as geometry that deforms, from positions in memory to a structure that
/// can be asked; with a figure `_device`.
std::vector<Figure> measure_builds(const SuiteOptions& options);

}  // namespace hil::bench
