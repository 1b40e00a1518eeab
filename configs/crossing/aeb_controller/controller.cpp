#include "configs/crossing/aeb_controller/controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hil::crossing::aeb {

namespace {

constexpr double forever_s = std::numeric_limits<double>::infinity();
constexpr double still_mps = 0.1;        // below this speed an object has no direction
constexpr double min_distance_m = 0.01;  // keeps the required deceleration finite

struct Interval {
  double begin_s;
  double end_s;
};

/// Half the extent of the object along x and y: of a box along its velocity, or of a square when it is at
/// rest.
struct HalfExtent {
  double x_m;
  double y_m;
};

HalfExtent half_extent(const ObjectReport& object, const Parameters& parameters) {
  const double half_length = 0.5 * object.length_m;
  const double speed = std::hypot(object.velocity_x_mps, object.velocity_y_mps);
  if (speed < still_mps) {
    const double half = std::max(half_length, parameters.object_half_width_m);
    return {half, half};
  }
  const double along = std::abs(object.velocity_x_mps) / speed;
  const double across = std::abs(object.velocity_y_mps) / speed;
  return {along * half_length + across * parameters.object_half_width_m,
          across * half_length + along * parameters.object_half_width_m};
}

/// The interval of t in which `position + velocity * t` lies within [low, high].
std::optional<Interval> time_within(double position, double velocity, double low, double high) {
  if (std::abs(velocity) < still_mps) {
    if (position < low || position > high) return std::nullopt;
    return Interval{-forever_s, forever_s};
  }
  const double first = (low - position) / velocity;
  const double second = (high - position) / velocity;
  return Interval{std::min(first, second), std::max(first, second)};
}

}  // namespace

ObjectReport extrapolated(const ObjectReport& object, const EgoState& ego) {
  const double turned = ego.yaw_rate_radps * object.age_s;
  const double driven = ego.speed_mps * object.age_s;
  const double x = object.x_m + object.velocity_x_mps * object.age_s - driven * std::cos(0.5 * turned);
  const double y = object.y_m + object.velocity_y_mps * object.age_s - driven * std::sin(0.5 * turned);
  const double c = std::cos(turned);
  const double s = std::sin(turned);
  ObjectReport now = object;
  now.x_m = c * x + s * y;
  now.y_m = -s * x + c * y;
  now.velocity_x_mps = c * object.velocity_x_mps + s * object.velocity_y_mps;
  now.velocity_y_mps = -s * object.velocity_x_mps + c * object.velocity_y_mps;
  now.age_s = 0.0;
  return now;
}

std::optional<Conflict> find_conflict(const EgoState& ego, const ObjectReport& object,
                                      const Parameters& parameters) {
  const HalfExtent half = half_extent(object, parameters);
  if (object.x_m + half.x_m < 0.0)
    return std::nullopt;  // braking does not help against an object behind the front
  const double reach = parameters.ego_half_width_m + parameters.lateral_margin_m + half.y_m;
  const auto in_corridor = time_within(object.y_m, object.velocity_y_mps, -reach, reach);
  // In the ego's frame the object approaches; it overlaps the ego's length while its centre is in this
  // interval.
  const double closing_mps = ego.speed_mps - object.velocity_x_mps;
  const auto alongside = time_within(object.x_m, -closing_mps, -parameters.ego_length_m - half.x_m, half.x_m);
  if (!in_corridor || !alongside) return std::nullopt;
  const double begin_s = std::max({in_corridor->begin_s - parameters.time_margin_s, alongside->begin_s, 0.0});
  const double end_s = std::min(in_corridor->end_s + parameters.time_margin_s, alongside->end_s);
  if (begin_s > end_s || begin_s > parameters.horizon_s) return std::nullopt;

  // Behind an object that drives ahead the ego needs its speed; before any other object it has to stop.
  const double target_mps = std::max(object.velocity_x_mps, 0.0);
  const double excess_mps = ego.speed_mps - target_mps;
  if (excess_mps <= 0.0) return std::nullopt;
  const double approach_m = std::max(-object.velocity_x_mps, 0.0) * begin_s;
  const double free_m = object.x_m - half.x_m - parameters.stop_gap_m - approach_m;
  return Conflict{begin_s, excess_mps * excess_mps / (2.0 * std::max(free_m, min_distance_m))};
}

void Controller::ego_status(std::int64_t time_ns, const EgoState& ego) {
  ego_ = ego;
  ego_time_ns_ = time_ns;
}

BrakeDecision Controller::object_list(std::int64_t time_ns, std::span<const ObjectReport> objects) {
  BrakeDecision decision;
  if (!ego_time_ns_ || time_ns - *ego_time_ns_ > parameters_.ego_timeout_ns) {
    latched_mps2_ = 0.0;
    decision.degraded = true;
    return decision;
  }
  double demand_mps2 = 0.0;
  bool conflict_found = false;
  bool brake = false;
  for (const ObjectReport& object : objects) {
    if (!object.valid) continue;
    const auto conflict = find_conflict(ego_, extrapolated(object, ego_), parameters_);
    if (!conflict) continue;
    conflict_found = true;
    demand_mps2 = std::max(demand_mps2, conflict->demand_mps2);
    brake = brake || conflict->demand_mps2 >= parameters_.brake_demand_mps2 ||
            conflict->time_s <= parameters_.brake_time_s;
  }
  const bool at_rest = std::abs(ego_.speed_mps) < parameters_.standstill_mps;
  const bool is_frozen =
      parameters_.checks_plausibility && plausibility_.is_frozen(time_ns, at_rest, objects);
  if (conflict_found || is_frozen) last_conflict_ns_ = time_ns;
  if (at_rest || (!conflict_found && time_ns - last_conflict_ns_ >= parameters_.release_after_ns))
    latched_mps2_ = 0.0;
  if (!at_rest && conflict_found && (brake || latched_mps2_ > 0.0)) {
    const double commanded_mps2 =
        std::min(demand_mps2 * parameters_.demand_factor, parameters_.maximum_deceleration_mps2);
    latched_mps2_ = std::max(latched_mps2_, commanded_mps2);
  }
  if (is_frozen) latched_mps2_ = std::max(latched_mps2_, parameters_.frozen_deceleration_mps2);
  decision.deceleration_mps2 = latched_mps2_;
  decision.warning = latched_mps2_ > 0.0 || (conflict_found && demand_mps2 >= parameters_.warn_demand_mps2);
  return decision;
}

}  // namespace hil::crossing::aeb
