#include "runtime/modules/laser_scanner/sweep_comparison.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace hil::modules {
namespace {

/// A face whose normal has a smaller cosine with a direction counts as parallel to the direction.
constexpr double max_parallel_cosine = 0.3;

glm::dvec2 unit(double heading_rad) {
  return {std::cos(heading_rad), std::sin(heading_rad)};
}

}  // namespace

SweepComparison::SweepComparison(const ScanPattern& pattern, std::vector<ComparedBody> bodies)
    : pattern_(pattern),
      bodies_(std::move(bodies)),
      measurements_(bodies_.size()),
      findings_(bodies_.size()) {
  for (Measurements& collected : measurements_) {
    collected.moving.reserve(max_points);
    collected.still.reserve(max_points);
  }
  for (Finding& finding : findings_) {
    finding.moving_points.reserve(max_points);
    finding.still_points.reserve(max_points);
  }
}

void SweepComparison::begin_sweep(std::int64_t begin_ns, const SensorMotion& sensor,
                                  std::span<const std::optional<ComparedMotion>> bodies) noexcept {
  begin_ns_ = begin_ns;
  sensor_ = sensor;
  for (std::size_t i = 0; i < measurements_.size(); ++i) {
    measurements_[i].motion = bodies[i];
    measurements_[i].moving.clear();
    measurements_[i].still.clear();
    measurements_[i].too_many = false;
  }
}

void SweepComparison::add_hit(const rtstdb::RayHit& hit, std::uint32_t column, std::uint32_t row,
                              bool still) noexcept {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].entity != hit.entity || !measurements_[i].motion) continue;
    std::vector<Point>& points = still ? measurements_[i].still : measurements_[i].moving;
    if (points.size() == max_points) {
      measurements_[i].too_many = findings_[i].too_many = true;
      return;
    }
    const glm::dvec3 p = glm::dvec3(pattern_.direction(column, row)) * static_cast<double>(hit.lambda);
    const glm::dvec2 travel = unit(measurements_[i].motion->heading_rad);
    const glm::dvec3 n = hit.n_world;
    const double along = glm::dot(glm::dvec2(n), travel);
    points.push_back(
        {.point = {p.x, p.y, p.z, pattern_.azimuth_rad(column), pattern_.elevation_rad(row), hit.lambda, 0},
         .column = column,
         .side = std::abs(n.z) < max_parallel_cosine && std::abs(along) < max_parallel_cosine});
    return;
  }
}

double SweepComparison::column_width_m(const glm::dvec2& p_sensor_m, const glm::dvec2& along) const noexcept {
  const double range_m = glm::length(p_sensor_m);
  const double incidence = std::abs(p_sensor_m.x * along.y - p_sensor_m.y * along.x) / range_m;
  return pattern_.pitch_rad() * range_m / std::max(incidence, 0.1);
}

std::optional<SweepComparison::Measured> SweepComparison::measure(const std::vector<Point>& points,
                                                                  double heading_rad) const noexcept {
  Measured measured{.length_m = 0.0, .first_column = pattern_.columns(), .last_column = 0};
  for (const Point& point : points) {
    if (!point.side) continue;
    measured.first_column = std::min(measured.first_column, point.column);
    measured.last_column = std::max(measured.last_column, point.column);
  }
  // A side that touches the border of the field of view may be longer than its measured part.
  if (measured.first_column == 0 || measured.first_column >= measured.last_column ||
      measured.last_column + 1 >= pattern_.columns()) {
    return std::nullopt;
  }
  // The body's direction in the sensor frame.
  const glm::dvec2 along = unit(heading_rad - sensor_.heading_rad);
  glm::dvec2 sum[2] = {glm::dvec2(0.0), glm::dvec2(0.0)};
  double count[2] = {0.0, 0.0};
  for (const Point& point : points) {
    if (!point.side || (point.column != measured.first_column && point.column != measured.last_column))
      continue;
    const int edge = point.column == measured.first_column ? 0 : 1;
    sum[edge] += glm::dvec2(point.point.x_m, point.point.y_m);
    count[edge] += 1.0;
  }
  // A beam represents half a column to each side.
  const glm::dvec2 first = sum[0] / count[0];
  const glm::dvec2 last = sum[1] / count[1];
  const double between_m = std::abs(glm::dot(first - last, along));
  measured.length_m = between_m + 0.5 * (column_width_m(first, along) + column_width_m(last, along));
  return measured;
}

void SweepComparison::evaluate(std::size_t body) noexcept {
  const Measurements& measured = measurements_[body];
  Finding& finding = findings_[body];
  if (finding.complete || !measured.motion || measured.too_many) return;
  const ComparedBody& facts = bodies_[body];
  const ComparedMotion& motion = *measured.motion;
  const auto still = measure(measured.still, motion.heading_rad);
  const auto moving = measure(measured.moving, motion.heading_rad);
  if (!still || !moving) return;
  // The edges of the side that faces the sensor.
  const glm::dvec2 travel = unit(motion.heading_rad);
  glm::dvec2 across = glm::dvec2(-travel.y, travel.x);
  if (glm::dot(sensor_.point.p_m - motion.center.p_m, across) < 0.0) across = -across;
  const glm::dvec2 side = motion.center.p_m + 0.5 * facts.width_m * across;
  const auto closed_form =
      apparent_length_m(pattern_, sensor_, {side + 0.5 * facts.length_m * travel, motion.center.v_mps},
                        {side - 0.5 * facts.length_m * travel, motion.center.v_mps});
  if (!closed_form) return;
  const SensorMotion turned{.point = {}, .heading_rad = sensor_.heading_rad};
  const double pitch_m = column_width_m(turned.seen(side - sensor_.point.p_m, 0.0), turned.seen(travel, 0.0));
  // Without motion the measured length is the true length, unless another body hid a part of the side.
  if (std::abs(still->length_m - facts.length_m) > 0.01 * facts.length_m + pitch_m) return;

  finding.complete = true;
  finding.begin_ns = begin_ns_;
  finding.still = *still;
  finding.moving = *moving;
  finding.closed_form_m = *closed_form;
  finding.tolerance_m = 0.01 * *closed_form + pitch_m;
  for (const Point& point : measured.moving)
    finding.moving_points.push_back(point.point);
  for (const Point& point : measured.still)
    finding.still_points.push_back(point.point);
}

void SweepComparison::end_sweep() noexcept {
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    evaluate(i);
}

}  // namespace hil::modules
