#pragma once
// Rays with individual times through moving, rotating instances, compared with Embree's motion blur.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// ray_moving_instances and ray_moving_instances_scan, each with a figure _device by the device's own time.
/// Throws std::runtime_error when the results disagree.
std::vector<Figure> measure_instances(const SuiteOptions& options);

}  // namespace hil::bench
