#pragma once
// What every query's elements have in common: finite numbers, an instant that the version covers, a carrier
// that lives.

#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_float4.hpp>

#include <optional>

#include "rtstdb/geometry/field_check.hpp"
#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

/// not_finite or out_of_limits (coordinates beyond max_coordinate_m), with the values and the field at fault.
std::optional<BadInput> check_point(const glm::vec3& point_m, std::uint32_t element,
                                    const VectorFields& fields) noexcept;

/// Refuses with the four values.
BadInput refused(BadInputReason reason, std::uint32_t element, const glm::vec4& values) noexcept;

/// time_not_covered with the time and the version's own in seconds; otherwise widens `times`.
std::optional<BadInput> check_time(WorldTime t, std::uint32_t element, const RowSource& rows,
                                   TimeSpan& times) noexcept;

/// An invalid id is no carrier, which is allowed.
std::optional<BadInput> check_carrier(EntityId carrier, std::uint32_t element,
                                      const RowSource& rows) noexcept;

}  // namespace rtstdb::query
