#pragma once
// The returns of a scanner's beam, which a query finds, and what the receiver measures of them.
//
// Units: metres; intensities in 1/m^2, as reflectance * covered fraction * cosine of incidence / range^2.
// Threads: plain data.

#include <cstdint>

#include <rtstdb/query.hpp>

namespace hil::modules {

/// The return of one entity. The hit's lambda is the range along the beam's axis.
struct BeamReturn {
  rtstdb::RayHit hit{};
  float fraction = 1.0f;  ///< of the beam's cross-section that reaches the entity
};

/// Identifies a return within a run.
struct ReturnNumber {
  std::int64_t sweep_begin_ns = 0;
  std::uint64_t beam = 0;     ///< in the sweep
  std::uint32_t ordinal = 0;  ///< in the beam; the nearest return is 0
};

/// What the receiver measures of a return.
struct Detection {
  double range_m = 0.0;
  double intensity_per_m2 = 0.0;
};

}  // namespace hil::modules
