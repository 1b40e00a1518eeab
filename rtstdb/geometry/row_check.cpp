#include "rtstdb/geometry/row_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/geometry/field_check.hpp"

namespace rtstdb {
namespace {

constexpr VectorFields scale_fields{"scale.x", "scale.y", "scale.z"};
constexpr VectorFields position_fields{"motion.p_world_m.x", "motion.p_world_m.y", "motion.p_world_m.z"};
constexpr VectorFields velocity_fields{"motion.v_world_mps.x", "motion.v_world_mps.y",
                                       "motion.v_world_mps.z"};
constexpr VectorFields angular_velocity_fields{"motion.w_world_radps.x", "motion.w_world_radps.y",
                                               "motion.w_world_radps.z"};
constexpr QuaternionFields orientation_fields{"motion.q_world.w", "motion.q_world.x", "motion.q_world.y",
                                              "motion.q_world.z"};

BadInput fault(BadInputReason reason, const glm::dvec3& v) noexcept {
  BadInput bad;
  bad.reason = reason;
  bad.values[0] = v.x;
  bad.values[1] = v.y;
  bad.values[2] = v.z;
  return bad;
}

BadInput fault(BadInputReason reason, const glm::dquat& q) noexcept {
  BadInput bad = fault(reason, {q.w, q.x, q.y});
  bad.values[3] = q.z;
  return bad;
}

bool finite(const glm::dvec3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool finite(const glm::dquat& q) noexcept {
  return std::isfinite(q.w) && finite(glm::dvec3{q.x, q.y, q.z});
}

double largest_component(const glm::dvec3& v) noexcept {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

double largest_component(const glm::dquat& q) noexcept {
  return std::max(std::abs(q.w), largest_component(glm::dvec3{q.x, q.y, q.z}));
}

double length(const glm::dvec3& v) noexcept {
  return std::hypot(v.x, v.y, v.z);
}

/// A quaternion whose components are all subnormal has lost the digits of its direction.
bool can_be_normalised(const glm::dquat& q) noexcept {
  return largest_component(q) >= std::numeric_limits<double>::min();
}

}  // namespace

std::optional<BadInput> check_motion(const Motion& motion) noexcept {
  using enum BadInputReason;
  const auto& [p_m, q, v_mps, w_radps, valid_from] = motion;
  if (!finite(p_m)) return with_field(fault(not_finite, p_m), position_fields, p_m);
  if (!finite(q)) return with_field(fault(not_finite, q), orientation_fields, q);
  if (!finite(v_mps)) return with_field(fault(not_finite, v_mps), velocity_fields, v_mps);
  if (!finite(w_radps)) return with_field(fault(not_finite, w_radps), angular_velocity_fields, w_radps);
  if (!can_be_normalised(q)) return fault(zero_quaternion, q);
  if (largest_component(p_m) > max_coordinate_m)
    return with_field(fault(out_of_limits, p_m), position_fields, p_m, {-max_coordinate_m, max_coordinate_m});
  if (length(v_mps) > max_speed_mps)
    return with_field(fault(out_of_limits, v_mps), "the length of motion.v_world_mps", length(v_mps),
                      {0.0, max_speed_mps});
  if (length(w_radps) > max_angular_rate_radps)
    return with_field(fault(out_of_limits, w_radps), "the length of motion.w_world_radps", length(w_radps),
                      {0.0, max_angular_rate_radps});
  return std::nullopt;
}

std::optional<BadInput> check_row(const EntityRow& row) noexcept {
  using enum BadInputReason;
  if (!finite(row.scale)) return with_field(fault(not_finite, row.scale), scale_fields, row.scale);
  const double smallest = std::min({row.scale.x, row.scale.y, row.scale.z});
  const double largest = std::max({row.scale.x, row.scale.y, row.scale.z});
  if (smallest < min_scale || largest > max_scale)
    return with_field(fault(out_of_limits, row.scale), scale_fields, row.scale, {min_scale, max_scale});
  return check_motion(row.motion);
}

std::optional<BadInput> check_positions(std::span<const glm::vec3> positions_m) noexcept {
  constexpr auto limit = static_cast<float>(max_coordinate_m);
  static_assert(static_cast<double>(limit) == max_coordinate_m);
  // Without an early exit, so that the loop is vectorised. The comparison is false for NaN too.
  bool all_good = true;
  for (const glm::vec3& p : positions_m)
    all_good &= (std::abs(p.x) <= limit) & (std::abs(p.y) <= limit) & (std::abs(p.z) <= limit);
  if (all_good) return std::nullopt;
  std::size_t i = 0;
  while (largest_component(positions_m[i]) <= max_coordinate_m && finite(positions_m[i]))
    ++i;
  const bool is_finite = finite(positions_m[i]);
  BadInput bad =
      fault(is_finite ? BadInputReason::out_of_limits : BadInputReason::not_finite, positions_m[i]);
  bad.values[3] = static_cast<double>(i);
  return bad;
}

Motion normalised(const Motion& motion) noexcept {
  RTSTDB_ASSERT(finite(motion.q_world) && can_be_normalised(motion.q_world),
                "the quaternion is zero or not finite");
  const double largest = largest_component(motion.q_world);
  const glm::dquat& q = motion.q_world;
  // Scaled to about one first, so that no square overflows or underflows.
  const double w = q.w / largest;
  const double x = q.x / largest;
  const double y = q.y / largest;
  const double z = q.z / largest;
  const double norm = std::sqrt(w * w + x * x + y * y + z * z);
  Motion unit = motion;
  unit.q_world = {w / norm, x / norm, y / norm, z / norm};
  return unit;
}

EntityRow normalised(const EntityRow& row) noexcept {
  EntityRow unit = row;
  unit.motion = normalised(row.motion);
  return unit;
}

}  // namespace rtstdb
