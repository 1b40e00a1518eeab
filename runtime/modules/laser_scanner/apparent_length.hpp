#pragma once
// How long a passing body seems in a sweep (paper, Figure 8): while the beam turns from its one edge to the
// other the body moves on, so whoever takes the points as one instant's picture sees it compressed or
// stretched.

#include <glm/ext/vector_double2.hpp>

#include <cstdint>
#include <optional>

#include "runtime/modules/laser_scanner/scan_pattern.hpp"

namespace hil::modules {

/// A point that moves straight on, in world x and y; time counts from the sweep's begin.
struct MovingPoint {
  glm::dvec2 p_m{0.0};
  glm::dvec2 v_mps{0.0};
  glm::dvec2 at(double t_s) const noexcept { return p_m + v_mps * t_s; }
};

/// The sensor: position, velocity and heading (constant during the sweep).
struct SensorMotion {
  MovingPoint point;
  double heading_rad = 0.0;
  /// World point to sensor frame at that time.
  glm::dvec2 seen(const glm::dvec2& p_m, double t_s) const noexcept;
};

/// When the turning beam meets the point: seconds after the sweep's begin; empty when it does not within the
/// sweep.
std::optional<double> meeting_time_s(const ScanPattern& pattern, const SensorMotion& sensor,
                                     const MovingPoint& point);

/// Distance between where the two edges seem to be, along the body's own direction: the closed form that a
/// sweep is held against. Empty when the beam misses an edge.
std::optional<double> apparent_length_m(const ScanPattern& pattern, const SensorMotion& sensor,
                                        const MovingPoint& front, const MovingPoint& rear);

}  // namespace hil::modules
