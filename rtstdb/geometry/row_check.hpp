#pragma once
// The checks of rows and shapes that every write passes before it enters a version. Pure functions: any
// thread, no allocation, fit for the tick.

#include <glm/ext/vector_float3.hpp>

#include <optional>
#include <span>

#include <rtstdb/entity.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb {

/// The first fault of a motion, in this order; `values` holds the wrong values, padded with zeros.
///   not_finite       a component of position (x, y, z), orientation (w, x, y, z) or a velocity (x, y, z)
///   zero_quaternion  no component of the orientation is a normal number
///   out_of_limits    a position component beyond max_coordinate_m, a speed beyond max_speed_mps, an angular
///                    rate beyond max_angular_rate_radps
/// The orientation need not be normalised. The caller sets `element` and `entity`.
std::optional<BadInput> check_motion(const Motion& motion) noexcept;

/// The first fault of a row: its scale, then its motion. A row need not have a geometry; the caller checks
/// that its geometry exists.
///   not_finite        a scale factor
///   out_of_limits     a scale factor outside [min_scale, max_scale]
std::optional<BadInput> check_row(const EntityRow& row) noexcept;

/// The first position that is not_finite or, with a component beyond max_coordinate_m, out_of_limits;
/// `values` holds the position, then its index.
std::optional<BadInput> check_positions(std::span<const glm::vec3> positions_m) noexcept;

/// The same motion with a normalised orientation. Misuse: a motion that check_motion refuses. Normalising
/// twice changes at most the last bit.
Motion normalised(const Motion& motion) noexcept;
EntityRow normalised(const EntityRow& row) noexcept;

}  // namespace rtstdb
