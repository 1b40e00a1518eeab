#pragma once
// What a row may hold, and a shape: the checks that every write passes before it enters a version. Pure functions of their
// arguments: any thread, no allocation, fit for the tick.

#include <glm/ext/vector_float3.hpp>

#include <optional>
#include <span>

#include <rtstdb/entity.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb {

/// The first fault of a motion, in this order; `values` holds what was wrong, padded with zeros.
///   not_finite       a component of position (x, y, z), orientation (w, x, y, z) or a velocity (x, y, z)
///   zero_quaternion  no component of the orientation is a normal number
///   out_of_limits    a position component beyond max_coordinate_m, a speed beyond max_speed_mps, an angular
///                    rate beyond max_angular_rate_radps
/// The orientation need not be unit. `element` and `entity` are the caller's to fill.
std::optional<BadInput> check_motion(const Motion& motion) noexcept;

/// The first fault of a row: its scale, then its motion. A row may name no geometry; whether the one it names
/// exists is the caller's question.
///   not_finite        a scale factor
///   out_of_limits     a scale factor outside [min_scale, max_scale]
std::optional<BadInput> check_row(const EntityRow& row) noexcept;

/// The first position of a geometry that is not_finite or, by a component beyond max_coordinate_m, out_of_limits;
/// `values` holds it and then its index.
std::optional<BadInput> check_positions(std::span<const glm::vec3> positions_m) noexcept;

/// The same motion with a unit orientation, whatever the magnitude of the given one. It has passed
/// check_motion (misuse asserts). Normalising twice changes nothing beyond the last bit.
Motion normalised(const Motion& motion) noexcept;
EntityRow normalised(const EntityRow& row) noexcept;

}  // namespace rtstdb
