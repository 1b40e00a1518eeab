#include "rtstdb/query/element_check.hpp"

#include <algorithm>
#include <cmath>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {

BadInput refused(BadInputReason reason, std::uint32_t element, const glm::vec4& values) noexcept {
  return {.reason = reason,
          .element = element,
          .entity = {},
          .values = {static_cast<double>(values.x), static_cast<double>(values.y),
                     static_cast<double>(values.z), static_cast<double>(values.w)}};
}

std::optional<BadInput> check_point(const glm::vec3& point_m, std::uint32_t element,
                                    const VectorFields& fields) noexcept {
  constexpr float limit = static_cast<float>(max_coordinate_m);
  const glm::vec4 values(point_m, 0.0f);
  if (!std::isfinite(point_m.x) || !std::isfinite(point_m.y) || !std::isfinite(point_m.z))
    return with_field(refused(BadInputReason::not_finite, element, values), fields, glm::dvec3(point_m));
  if (std::abs(point_m.x) > limit || std::abs(point_m.y) > limit || std::abs(point_m.z) > limit)
    return with_field(refused(BadInputReason::out_of_limits, element, values), fields, glm::dvec3(point_m),
                      {-max_coordinate_m, max_coordinate_m});
  return std::nullopt;
}

std::optional<BadInput> check_time(WorldTime t, std::uint32_t element, const RowSource& rows,
                                   TimeSpan& times) noexcept {
  if (t < rows.time() || t > world_time_ns(max_world_time_ns)) {
    return BadInput{.reason = BadInputReason::time_not_covered,
                    .element = element,
                    .entity = {},
                    .values = {seconds_between(WorldTime{}, t), seconds_between(WorldTime{}, rows.time())}};
  }
  times.first = std::min(times.first, t);
  times.last = std::max(times.last, t);
  return std::nullopt;
}

std::optional<BadInput> check_carrier(EntityId carrier, std::uint32_t element,
                                      const RowSource& rows) noexcept {
  if (!carrier.valid() || rows.find(carrier) != nullptr) return std::nullopt;
  return BadInput{.reason = BadInputReason::unknown_entity, .element = element, .entity = carrier};
}

}  // namespace rtstdb::query
