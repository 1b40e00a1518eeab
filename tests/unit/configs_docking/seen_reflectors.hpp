#pragma once
// The reflectors that a scanner with square beams detects, which tile its field of view: the axis of the beam
// and the true range. Nothing is hidden.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include "configs/docking/guidance/position_fix.hpp"
#include "configs/docking/guidance/reflectors.hpp"

namespace hil::docking::guidance::test {

struct Beams {
  double field_rad = 0.6981317;  ///< 40 degrees
  int count = 64;                ///< in a row, and in a column
  double pitch_rad() const { return field_rad / (count - 1); }
};

/// `port_m`: the capsule's port, in the station frame.
inline std::vector<Detection> seen_reflectors(const glm::dvec3& port_m, const glm::dquat& attitude,
                                              const glm::dvec3& mount_body_m, const Beams& beams = {}) {
  std::vector<Detection> detections;
  for (const glm::dvec3& reflector : reflectors_m) {
    const glm::dvec3 p = glm::conjugate(attitude) * (reflector - port_m) - mount_body_m;
    const double azimuth = std::atan2(p.y, p.x), elevation = std::atan2(p.z, std::hypot(p.x, p.y));
    const double half = 0.5 * (beams.field_rad + beams.pitch_rad());
    if (std::abs(azimuth) > half || std::abs(elevation) > half) continue;
    const auto on_axis = [&](double angle) {
      const double first = -0.5 * beams.field_rad;
      return first + std::round((angle - first) / beams.pitch_rad()) * beams.pitch_rad();
    };
    detections.push_back({on_axis(azimuth), on_axis(elevation), glm::length(p)});
  }
  std::stable_sort(detections.begin(), detections.end(),
                   [](const Detection& a, const Detection& b) { return a.range_m < b.range_m; });
  return detections;
}

/// The attitude in which the capsule's x looks into the port, turned by a small rotation.
inline glm::dquat facing_the_port(const glm::dvec3& turned_rad = glm::dvec3(0.0)) {
  const glm::dquat facing(std::sqrt(0.5), 0.0, 0.0, -std::sqrt(0.5));
  const double angle = glm::length(turned_rad);
  return angle > 0.0 ? facing * glm::angleAxis(angle, turned_rad / angle) : facing;
}

}  // namespace hil::docking::guidance::test
