#pragma once
// The position of the capsule, from the reflectors that its scanner detects.
//
// The attitude is known, so three coordinates remain. Each pair of a detection and a reflector proposes a
// position. The one with which most detections agree is taken, and averaged over these detections.
//
// Frames: station as in reflectors.hpp; body: origin in the capsule's docking port, x out of it. The beam
// with azimuth and elevation 0 is along the body's x; azimuth counts to +y, elevation to +z. SI units.
// Threads: pure functions.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstddef>
#include <optional>
#include <span>

namespace hil::docking::guidance {

struct Detection {
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;
  double range_m = 0.0;
};

struct Scanner {
  glm::dvec3 mount_body_m{0.0};
  double beam_half_angle_rad = 0.0;  ///< a reflector is within this angle of the beam that detects it
};

struct PositionFix {
  glm::dvec3 p_station_m{0.0};  ///< of the capsule's port
  double sigma_m = 0.0;         ///< standard deviation across the line of sight, estimated
  std::size_t reflectors = 0;   ///< different ones among the detections that agree
  std::size_t detections = 0;   ///< that agree
};

/// The position with which most detections agree. With an expected position, only positions within `gate_m`
/// of it count. Empty: there is none.
std::optional<PositionFix> find_position(std::span<const Detection> detections, const glm::dquat& attitude,
                                         const Scanner& scanner);
std::optional<PositionFix> find_position(std::span<const Detection> detections, const glm::dquat& attitude,
                                         const Scanner& scanner, const glm::dvec3& expected_m, double gate_m);

}  // namespace hil::docking::guidance
