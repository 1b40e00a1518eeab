#pragma once
// An entity: a row that is a function of time (paper, Section 5, Table 1, plus the instant from which the
// motion holds).
//
// Frames: "world" is right-handed, metres. "entity" is the frame of the entity's geometry; its origin is the
// centre of rotation. At time t, the point p_entity of the entity is at
//     p_world(t) = p + v (t - valid_from) + R(exp(w (t - valid_from)) q) (scale * p_entity)
// with w in the world frame (rad/s). The rotation is the exponential map, not the paper's forward Euler step
// (Equation 1), which turns by 2 atan(w dt / 2). The functions of this header compute it in double precision.
// Queries compute it in single precision from an instant near the times of their batch: they are off by at
// most 2.4e-7 of the angle that the body turns in a second, and 2e-6 rad; that is 2.4e-3 rad at 10,000 rad/s.
//
// Threads: pure functions and plain data.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <compare>
#include <cstdint>
#include <limits>

#include <rtstdb/time.hpp>

namespace rtstdb {

/// Number of a commit with writes, ascending; 0 is the empty world. A transaction that fails after its number
/// was assigned uses the number up; only a crash before the log records that makes the number available
/// again.
using Version = std::uint64_t;

/// Identifies an entity permanently: a later entity may have the same `index`, but then another `generation`.
/// Default: no entity.
struct EntityId {
  std::uint32_t index = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t generation = 0;
  bool valid() const noexcept { return index != std::numeric_limits<std::uint32_t>::max(); }
  auto operator<=>(const EntityId&) const = default;  // NOLINT(modernize-use-nullptr): no pointer
};

/// Identifies a geometry: the first one added has index 0. Default: no geometry.
struct GeometryId {
  std::uint32_t index = std::numeric_limits<std::uint32_t>::max();
  bool valid() const noexcept { return index != std::numeric_limits<std::uint32_t>::max(); }
  auto operator<=>(const GeometryId&) const = default;
};

/// Identifies a material. Default: the default material, which exists in every database and has the default
/// values of Material; the first one added has index 1.
struct MaterialId {
  std::uint32_t index = 0;
  auto operator<=>(const MaterialId&) const = default;  // NOLINT(modernize-use-nullptr): no pointer
};

/// Identifies a light: the first one added has index 0. Default: no light.
struct LightId {
  std::uint32_t index = std::numeric_limits<std::uint32_t>::max();
  bool valid() const noexcept { return index != std::numeric_limits<std::uint32_t>::max(); }
  auto operator<=>(const LightId&) const = default;
};

/// Position, orientation and constant velocities. Limits: max_coordinate_m, max_speed_mps,
/// max_angular_rate_radps, max_world_time_ns.
struct Motion {
  glm::dvec3 p_world_m{0.0};  ///< of the entity's origin, at valid_from
  /// Entity frame to world frame, at valid_from; w first. Normalised on write; a zero quaternion is refused.
  glm::dquat q_world{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 v_world_mps{0.0};
  glm::dvec3 w_world_radps{0.0};
  WorldTime valid_from{};  ///< instant of p_world_m and q_world; any instant, also after the version's time
};

/// A query considers an entity if (query mask & entity mask) != 0.
inline constexpr std::uint32_t mask_all = 0xFFFFFFFFu;

struct EntityRow {
  GeometryId geometry{};  ///< invalid: no query finds the entity, but it may carry queries and a light
  glm::dvec3 scale{1.0};  ///< for each axis of the entity frame; min_scale to max_scale
  std::uint32_t mask = mask_all;
  MaterialId material{};  ///< must exist; part of each hit
  LightId light{};        ///< invalid: none; else it must exist
  Motion motion{};
};

/// Position and orientation (entity frame to world frame) of an entity at one instant.
struct Pose {
  glm::dvec3 p_world_m{0.0};
  glm::dquat q_world{1.0, 0.0, 0.0, 0.0};
};

/// The pose at time t, before and after valid_from alike. Double precision.
Pose pose_at(const Motion& motion, WorldTime t) noexcept;

/// Describes the same motion from valid_from = t on: pose_at gives the same poses for both, up to rounding.
Motion rebased(const Motion& motion, WorldTime t) noexcept;

}  // namespace rtstdb
