#pragma once
// Rays at times of their own through moving, turning instances, beside Embree's motion blur.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// ray_moving_instances and ray_moving_instances_scan, and each with _device by the device's own time alone. Throws
/// std::runtime_error when the sides disagree.
std::vector<Figure> measure_instances(const SuiteOptions& options);

}  // namespace hil::bench
