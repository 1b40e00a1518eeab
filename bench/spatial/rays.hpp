#pragma once
// Rays through one static mesh, compared with Embree.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// ray_closest_coherent, ray_closest_incoherent, ray_any_incoherent; each with a figure `_device` by the
/// device's own time. Throws std::runtime_error when the results disagree.
std::vector<Figure> measure_rays(const SuiteOptions& options);

}  // namespace hil::bench
