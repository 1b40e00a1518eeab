#include "runtime/modules/laser_scanner/apparent_length.hpp"

#include <glm/geometric.hpp>

#include <cmath>

namespace hil::modules {

glm::dvec2 SensorMotion::seen(const glm::dvec2& p_m, double t_s) const noexcept {
  const glm::dvec2 d = p_m - point.at(t_s);
  const double c = std::cos(heading_rad);
  const double s = std::sin(heading_rad);
  return {c * d.x + s * d.y, -s * d.x + c * d.y};
}

std::optional<double> meeting_time_s(const ScanPattern& pattern, const SensorMotion& sensor,
                                     const MovingPoint& point) {
  const auto ahead_of_beam = [&](double t_s) {
    const glm::dvec2 seen = sensor.seen(point.at(t_s), t_s);
    return std::atan2(seen.y, seen.x) - pattern.beam_azimuth_rad(t_s);
  };
  double low_s = 0.0;
  double high_s = static_cast<double>(pattern.options().period_ns) * 1e-9;
  const bool rises = ahead_of_beam(low_s) < 0.0;
  if (rises == (ahead_of_beam(high_s) < 0.0)) return std::nullopt;
  for (int i = 0; i < 100; ++i) {
    const double middle_s = 0.5 * (low_s + high_s);
    ((ahead_of_beam(middle_s) < 0.0) == rises ? low_s : high_s) = middle_s;
  }
  const double meets_s = 0.5 * (low_s + high_s);
  // Behind the sensor the azimuth jumps by a whole turn, which changes the sign without a meeting.
  if (std::abs(ahead_of_beam(meets_s)) > 1e-3) return std::nullopt;
  return meets_s;
}

std::optional<double> apparent_length_m(const ScanPattern& pattern, const SensorMotion& sensor,
                                        const MovingPoint& front, const MovingPoint& rear) {
  const auto front_s = meeting_time_s(pattern, sensor, front);
  const auto rear_s = meeting_time_s(pattern, sensor, rear);
  if (!front_s || !rear_s) return std::nullopt;
  const glm::dvec2 seen = sensor.seen(front.at(*front_s), *front_s) - sensor.seen(rear.at(*rear_s), *rear_s);
  const SensorMotion still{.point = {}, .heading_rad = sensor.heading_rad};
  const glm::dvec2 along = glm::normalize(still.seen(front.p_m - rear.p_m, 0.0));
  return std::abs(glm::dot(seen, along));
}

}  // namespace hil::modules
