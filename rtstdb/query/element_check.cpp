#include "rtstdb/query/element_check.hpp"

#include <algorithm>
#include <cmath>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {

bool finite_within_limits(const glm::vec3& v) noexcept {
  constexpr float limit = static_cast<float>(max_coordinate_m);
  return std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;
}

std::optional<BadInput> check_time(WorldTime t, std::uint32_t element, const RowSource& rows,
                                   TimeSpan& times) noexcept {
  if (t < rows.time()) {
    return BadInput{.reason = BadInputReason::time_not_covered,
                    .element = element,
                    .entity = {},
                    .values = {static_cast<double>(t.time_since_epoch().count()),
                               static_cast<double>(rows.time().time_since_epoch().count())}};
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
