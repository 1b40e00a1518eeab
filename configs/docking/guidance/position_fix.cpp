#include "configs/docking/guidance/position_fix.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "configs/docking/guidance/reflectors.hpp"

namespace hil::docking::guidance {

namespace {

constexpr std::size_t max_detections = 8;
constexpr double map_tolerance_m = 0.03;  // of the reflectors' places and of the measured range
constexpr double min_sigma_m = 0.005;

/// A detection as a vector from the capsule's port, in the station's axes.
struct Sighting {
  glm::dvec3 arm_m{0.0};
  double tolerance_m = 0.0;
};

struct Agreement {
  PositionFix fix;
  double sum_of_squares = std::numeric_limits<double>::infinity();

  bool is_better_than(const Agreement& other) const {
    if (fix.detections != other.fix.detections) return fix.detections > other.fix.detections;
    return sum_of_squares < other.sum_of_squares;
  }
};

Sighting sighting_of(const Detection& detection, const glm::dquat& attitude, const Scanner& scanner) {
  const double c = std::cos(detection.elevation_rad);
  const glm::dvec3 direction(c * std::cos(detection.azimuth_rad), c * std::sin(detection.azimuth_rad),
                             std::sin(detection.elevation_rad));
  return {.arm_m = attitude * (scanner.mount_body_m + detection.range_m * direction),
          .tolerance_m = map_tolerance_m + detection.range_m * std::sin(scanner.beam_half_angle_rad)};
}

std::size_t nearest_reflector(const glm::dvec3& p_station_m) {
  std::size_t nearest = 0;
  for (std::size_t k = 1; k < reflectors_m.size(); ++k) {
    if (glm::distance(reflectors_m[k], p_station_m) < glm::distance(reflectors_m[nearest], p_station_m))
      nearest = k;
  }
  return nearest;
}

/// The detections that agree with a position, and the mean of the positions that they propose.
Agreement agreement_with(const glm::dvec3& p_m, std::span<const Sighting> sightings) {
  Agreement agreement;
  std::array<bool, reflector_count> seen{};
  glm::dvec3 sum(0.0);
  double squares = 0.0, tolerance_m = 0.0;
  for (const Sighting& sighting : sightings) {
    const std::size_t reflector = nearest_reflector(p_m + sighting.arm_m);
    const glm::dvec3 proposed = reflectors_m[reflector] - sighting.arm_m;
    const double error_m = glm::distance(proposed, p_m);
    if (error_m > sighting.tolerance_m) continue;
    ++agreement.fix.detections;
    agreement.fix.reflectors += seen[reflector] ? 0 : 1;
    seen[reflector] = true;
    sum += proposed;
    squares += error_m * error_m;
    tolerance_m = std::max(tolerance_m, sighting.tolerance_m);
  }
  if (agreement.fix.detections == 0) return agreement;
  const auto count = static_cast<double>(agreement.fix.detections);
  agreement.fix.p_station_m = sum / count;
  agreement.fix.sigma_m = std::max(min_sigma_m, tolerance_m / std::sqrt(3.0 * count));
  agreement.sum_of_squares = squares;
  return agreement;
}

template <typename Permits>
std::optional<PositionFix> best_position(std::span<const Detection> detections, const glm::dquat& attitude,
                                         const Scanner& scanner, const Permits& permits) {
  std::array<Sighting, max_detections> all;
  const std::size_t count = std::min(detections.size(), max_detections);
  for (std::size_t i = 0; i < count; ++i)
    all[i] = sighting_of(detections[i], attitude, scanner);
  const std::span<const Sighting> sightings = std::span(all).first(count);
  Agreement best;
  for (const Sighting& sighting : sightings) {
    for (const glm::dvec3& reflector : reflectors_m) {
      const glm::dvec3 proposed = reflector - sighting.arm_m;
      if (!permits(proposed)) continue;
      const Agreement agreement = agreement_with(proposed, sightings);
      if (agreement.is_better_than(best)) best = agreement;
    }
  }
  if (best.fix.detections == 0) return std::nullopt;
  // The mean may bring further detections within their tolerances.
  const Agreement refined = agreement_with(best.fix.p_station_m, sightings);
  return refined.fix.detections >= best.fix.detections ? refined.fix : best.fix;
}

}  // namespace

std::optional<PositionFix> find_position(std::span<const Detection> detections, const glm::dquat& attitude,
                                         const Scanner& scanner) {
  return best_position(detections, attitude, scanner, [](const glm::dvec3&) { return true; });
}

std::optional<PositionFix> find_position(std::span<const Detection> detections, const glm::dquat& attitude,
                                         const Scanner& scanner, const glm::dvec3& expected_m,
                                         double gate_m) {
  return best_position(detections, attitude, scanner, [&](const glm::dvec3& proposed) {
    return glm::distance(proposed, expected_m) <= gate_m;
  });
}

}  // namespace hil::docking::guidance
