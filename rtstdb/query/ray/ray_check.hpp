#pragma once
// What a ray query refuses: options when it is prepared, rays when a transaction is submitted.

#include <cmath>
#include <limits>
#include <optional>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

/// Errors: bad_input for an unknown mode or faces; capacity.
Result<void> check_ray_options(const RayQueryOptions& options);

/// What is wrong with a ray; `element` is its number. `ignore_motion`: the ray's time does not matter.
std::optional<BadInput> check_ray(const Ray& ray, std::uint32_t element, bool ignore_motion,
                                  const RowSource& rows) noexcept;

/// not_finite, or bad_ray for a direction that is too short or too long.
std::optional<BadInput> check_direction(const glm::vec3& direction, std::uint32_t element) noexcept;

/// The range of a direction's largest component in which every product of the search is a finite, normal
/// float.
inline constexpr float min_direction_component = 1e-15f;
inline constexpr float max_direction_component = 1e15f;

/// Whether everything of a ray but its time and its carrier is valid. Without branches, for long batches.
inline bool is_valid_ray(const Ray& ray) noexcept {
  constexpr float limit = static_cast<float>(max_coordinate_m);
  const auto within = [](const glm::vec3& v, float bound) {
    return (std::abs(v.x) <= bound) & (std::abs(v.y) <= bound) & (std::abs(v.z) <= bound);
  };
  const glm::vec3& d = ray.direction;
  const bool has_length = (std::abs(d.x) >= min_direction_component) |
                          (std::abs(d.y) >= min_direction_component) |
                          (std::abs(d.z) >= min_direction_component);
  return within(ray.origin_m, limit) & within(d, max_direction_component) & has_length &
         (ray.lambda_min >= 0.0f) & (ray.lambda_max >= ray.lambda_min) &
         (ray.lambda_min <= std::numeric_limits<float>::max());
}

}  // namespace rtstdb::query
