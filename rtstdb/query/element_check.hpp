#pragma once
// Checks that elements of several kinds share: finite numbers, a time that the version covers, a carrier that
// exists.

#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_float4.hpp>

#include <optional>

#include "rtstdb/geometry/field_check.hpp"
#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

/// not_finite or out_of_limits (coordinates beyond max_coordinate_m), with the values and the field at fault.
std::optional<BadInput> check_point(const glm::vec3& point_m, std::uint32_t element,
                                    const VectorFields& fields) noexcept;

/// The refusal of an element for this reason, with up to four values.
BadInput refused(BadInputReason reason, std::uint32_t element, const glm::vec4& values) noexcept;

/// time_not_covered, with the element's time and the version's in seconds; otherwise extends `times`.
std::optional<BadInput> check_time(WorldTime t, std::uint32_t element, const RowSource& rows,
                                   TimeSpan& times) noexcept;

/// unknown_entity where the carrier does not exist. An invalid id means no carrier and is allowed.
std::optional<BadInput> check_carrier(EntityId carrier, std::uint32_t element,
                                      const RowSource& rows) noexcept;

}  // namespace rtstdb::query
