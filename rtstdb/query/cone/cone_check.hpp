#pragma once
// What a cone query refuses: options when it is prepared, cones when a transaction is submitted.

#include <optional>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

/// The largest opening angle: the last float below pi.
inline constexpr float max_opening_angle_rad = 0x1.921fb4p+1f;

/// Errors: bad_input for unknown faces or an unknown mode; capacity.
Result<void> check_cone_options(const ConeQueryOptions& options);

/// What is wrong with a cone; empty: nothing. `element` is its number. Extends `times` by the cone's time.
std::optional<BadInput> check_cone(const Cone& cone, std::uint32_t element, const RowSource& rows,
                                   TimeSpan& times) noexcept;

}  // namespace rtstdb::query
