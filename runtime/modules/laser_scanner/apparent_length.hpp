#pragma once
// The apparent length of a passing body in a sweep (paper, Figure 8): while the beam turns from one edge of
// the body to the other, the body moves on. When all points count as points of one instant, the body is
// compressed or stretched.

#include <glm/ext/vector_double2.hpp>

#include <cstdint>
#include <optional>

#include "runtime/modules/laser_scanner/scan_pattern.hpp"

namespace hil::modules {

/// A point with constant velocity, in world x and y; time counts from the start of the sweep.
struct MovingPoint {
  glm::dvec2 p_m{0.0};
  glm::dvec2 v_mps{0.0};
  glm::dvec2 at(double t_s) const noexcept { return p_m + v_mps * t_s; }
};

/// The sensor: position, velocity and heading; the heading is constant during the sweep.
struct SensorMotion {
  MovingPoint point;
  double heading_rad = 0.0;
  /// A world point in the sensor frame at that time.
  glm::dvec2 seen(const glm::dvec2& p_m, double t_s) const noexcept;
};

/// The time at which the turning beam meets the point, in seconds after the start of the sweep; empty: not in
/// this sweep.
std::optional<double> meeting_time_s(const ScanPattern& pattern, const SensorMotion& sensor,
                                     const MovingPoint& point);

/// The closed form: the distance between the measured positions of the two edges, along the body's direction.
/// Empty when the beam does not meet both edges.
std::optional<double> apparent_length_m(const ScanPattern& pattern, const SensorMotion& sensor,
                                        const MovingPoint& front, const MovingPoint& rear);

}  // namespace hil::modules
