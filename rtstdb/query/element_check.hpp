#pragma once
// What every query's elements have in common: finite numbers, an instant that the version covers, a carrier
// that lives.

#include <glm/ext/vector_float3.hpp>

#include <optional>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

bool finite_within_limits(const glm::vec3& v) noexcept;

std::optional<BadInput> check_time(WorldTime t, std::uint32_t element, const RowSource& rows,
                                   TimeSpan& times) noexcept;

/// An invalid id is no carrier, which is allowed.
std::optional<BadInput> check_carrier(EntityId carrier, std::uint32_t element,
                                      const RowSource& rows) noexcept;

}  // namespace rtstdb::query
