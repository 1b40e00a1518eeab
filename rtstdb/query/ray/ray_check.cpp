#include "rtstdb/query/ray/ray_check.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"
#include "rtstdb/query/enumerator.hpp"

namespace rtstdb::query {
namespace {

/// False for NaN.
bool is_range(float lambda_min, float lambda_max) noexcept {
  return lambda_min >= 0.0f && lambda_max >= lambda_min && std::isfinite(lambda_min);
}

Result<void> check_hits_per_ray(const RayQueryOptions& options) {
  if (options.mode != RayMode::first && options.hits_per_ray != 1) {
    return Error{ErrorCode::bad_input, "ray query '" + options.name + "' has hits_per_ray " +
                                           std::to_string(options.hits_per_ray) + " in the mode " +
                                           to_string(options.mode) +
                                           ", whose rays have 1; use RayMode::first for more"};
  }
  constexpr std::uint32_t max_hits = max_hits_per_ray;
  if (options.hits_per_ray == 0 || options.hits_per_ray > max_hits) {
    return Error{ErrorCode::capacity, "ray query '" + options.name + "' asks for " +
                                          std::to_string(options.hits_per_ray) + " hits a ray; 1 to " +
                                          std::to_string(max_hits) + " are possible in its mode"};
  }
  if (std::uint64_t{options.capacity} * options.hits_per_ray > max_hits_per_query) {
    return Error{ErrorCode::capacity, "ray query '" + options.name + "' asks for " +
                                          std::to_string(options.capacity) + " rays of " +
                                          std::to_string(options.hits_per_ray) + " hits; " +
                                          std::to_string(max_hits_per_query) + " hits are possible"};
  }
  return {};
}

}  // namespace

Result<void> check_ray_options(const RayQueryOptions& options) {
  if (options.capacity == 0 || options.capacity > max_rays_per_query) {
    return Error{ErrorCode::capacity, "ray query '" + options.name + "' asks for a capacity of " +
                                          std::to_string(options.capacity) + " rays; 1 to " +
                                          std::to_string(max_rays_per_query) + " are possible"};
  }
  if (auto known = check_enumerator(options.name, "mode", options.mode, RayMode::first); !known) return known;
  if (auto known = check_enumerator(options.name, "faces", options.faces, Faces::back); !known) return known;
  return check_hits_per_ray(options);
}

std::optional<BadInput> check_direction(const glm::vec3& d, std::uint32_t element) noexcept {
  const glm::vec4 values(d, 0.0f);
  if (!std::isfinite(d.x) || !std::isfinite(d.y) || !std::isfinite(d.z))
    return with_field(refused(BadInputReason::not_finite, element, values),
                      {"direction.x", "direction.y", "direction.z"}, glm::dvec3(d));
  const float largest = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
  if (largest < min_direction_component || largest > max_direction_component)
    return refused(BadInputReason::bad_ray, element, values);
  return std::nullopt;
}

std::optional<BadInput> check_ray(const Ray& ray, std::uint32_t element, bool ignore_motion,
                                  const RowSource& rows) noexcept {
  if (const auto bad = check_point(ray.origin_m, element, {"origin_m.x", "origin_m.y", "origin_m.z"}))
    return bad;
  if (const auto bad = check_direction(ray.direction, element)) return bad;
  if (!is_range(ray.lambda_min, ray.lambda_max))
    return refused(BadInputReason::bad_lambda_range, element, {ray.lambda_min, ray.lambda_max, 0.0f, 0.0f});
  TimeSpan times;
  if (const auto bad = check_time(ignore_motion ? rows.time() : ray.t, element, rows, times)) return bad;
  return check_carrier(ray.carrier, element, rows);
}

}  // namespace rtstdb::query
