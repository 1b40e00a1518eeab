#pragma once
// An entity: a row that is a function of time (paper, Section 5, Table 1, plus the instant from which the
// motion holds).
//
// Frames: "world" is right-handed, metres. "entity" is the frame its geometry is given in; its origin is the
// centre of rotation. A point of the entity stands at time t at
//     p_world(t) = p + v (t - valid_from) + R(exp(w (t - valid_from)) q) (scale * p_entity)
// with w in the world frame (rad/s). Rotation is exact, not the paper's Euler step (which turns 2 atan(w dt /
// 2)).

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <compare>
#include <cstdint>
#include <limits>

#include <rtstdb/time.hpp>

namespace rtstdb {

/// Numbers the commits with writes, ascending; 0 is the empty database. A number whose transaction came to
/// nothing after it had begun is not given again, unless the process died before it was told of in the log.
using Version = std::uint64_t;

/// Names an entity for good: `index` is re-used after a delete, `generation` is not. Default: no entity.
struct EntityId {
  std::uint32_t index = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t generation = 0;
  bool valid() const noexcept { return index != std::numeric_limits<std::uint32_t>::max(); }
  auto operator<=>(const EntityId&) const = default;  // NOLINT(modernize-use-nullptr): no pointer
};

struct GeometryId {
  std::uint32_t index = std::numeric_limits<std::uint32_t>::max();
  bool valid() const noexcept { return index != std::numeric_limits<std::uint32_t>::max(); }
  auto operator<=>(const GeometryId&) const = default;
};

struct Motion {
  glm::dvec3 p_world_m{0.0};
  glm::dquat q_world{1.0, 0.0, 0.0,
                     0.0};  ///< entity -> world; w first; normalised on entry, a zero quaternion is refused
  glm::dvec3 v_world_mps{0.0};
  glm::dvec3 w_world_radps{0.0};
  WorldTime valid_from{};
};

/// Mask bits decide who sees whom: a query sees an entity when (query mask & entity mask) != 0.
inline constexpr std::uint32_t mask_all = 0xFFFFFFFFu;

struct EntityRow {
  GeometryId geometry{};  ///< invalid: nothing to be seen or touched, but the entity may carry queries
  glm::dvec3 scale{1.0};  ///< per axis of the entity frame, positive
  std::uint32_t mask = mask_all;
  std::uint32_t material = 0;  ///< the caller's number, handed back with hits
  Motion motion{};
};

/// Where an entity is at one instant.
struct Pose {
  glm::dvec3 p_world_m{0.0};
  glm::dquat q_world{1.0, 0.0, 0.0, 0.0};
};

/// The row read at time t. Defined for every t; in double precision.
Pose pose_at(const Motion& motion, WorldTime t) noexcept;

/// The same motion written down from `t` on: pose_at gives the same poses for both.
Motion rebased(const Motion& motion, WorldTime t) noexcept;

}  // namespace rtstdb
