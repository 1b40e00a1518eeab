#pragma once
// A point of a scanner's point cloud. Frame: that of the sensor at the instant of the point's beam. Metres,
// seconds of run time. Threads: plain data.

#include <cstdint>

namespace hil::modules {

/// A detected return. Without padding, since files contain it as it lies in memory.
struct CloudPoint {
  float x_m = 0.0f, y_m = 0.0f, z_m = 0.0f;
  float intensity_per_m2 = 0.0f;
  float fraction = 0.0f;  ///< of the beam's cross-section
  std::uint32_t column = 0, row = 0;
  std::uint32_t ordinal = 0;  ///< of the return in its beam
  std::uint32_t entity = 0;   ///< its index
  std::uint32_t material = 0;
  double time_s = 0.0;  ///< of the beam
};
static_assert(sizeof(CloudPoint) == 48);

}  // namespace hil::modules
