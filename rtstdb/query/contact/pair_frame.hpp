#pragma once
// The poses of two entities, and pairs of convex parts: from two rows to the record that the device searches,
// and from what the device finds back to world axes. Poses are computed in double precision relative to one
// another.
//
// Pure; no allocation.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_float4.hpp>

#include <cstdint>

#include "rtstdb/accel/geometry_pool.hpp"
#include "shaders/shared/contact.h"

namespace rtstdb::query {

/// A part of a body.
struct PairBody {
  const EntityRow& row;
  accel::GeometryPool::PooledHull hull;
};

/// Two entities at an instant.
struct BodyPoses {
  glm::dquat q_first{1.0, 0.0, 0.0, 0.0}, q_second{1.0, 0.0, 0.0, 0.0};  ///< entity to world
  glm::dvec3 second_m{0.0};        ///< the second origin from the first one, world axes
  glm::dvec3 v_relative_mps{0.0};  ///< of the origins: first minus second
  glm::dvec3 w_first_radps{0.0}, w_second_radps{0.0};

  BodyPoses() = default;
  BodyPoses(const EntityRow& first, const EntityRow& second, WorldTime t) noexcept;

  /// Velocity of the first body minus that of the second at a point.
  glm::vec3 v_relative_at_mps(const glm::dvec3& p_first_m) const noexcept;
};

struct PairFrame : BodyPoses {
  glm::dvec3 second_center_m{0.0};  ///< of the second hull, second entity's frame, scaled
  glm::dvec3 first_scale{1.0}, second_scale{1.0};
  accel::GeometryPool::PooledHull first_hull, second_hull;
  double precision_m = 0.0;  ///< the width of the pair's bounds

  PairFrame() = default;
  PairFrame(const PairBody& first, const PairBody& second, WorldTime t) noexcept;

  glm::vec3 to_world(const glm::vec3& direction) const noexcept {
    return glm::vec3(q_second * glm::dvec3(direction));
  }
  /// A position in the frame of the pair, from the first origin, world axes.
  glm::dvec3 from_first(const glm::vec3& position_m) const noexcept {
    return second_m + q_second * (second_center_m + glm::dvec3(position_m));
  }
  /// A point of the answer. `point`: position in the frame of the pair and depth; `n_world` and the faces: of
  /// the pair.
  ContactPoint contact_point(const glm::vec4& point, const glm::vec3& n_world, std::uint32_t first_face,
                             std::uint32_t second_face) const noexcept;
};

shared::PairRecord pair_record(const PairBody& first, const PairBody& second, WorldTime t, float margin_m,
                               bool is_named) noexcept;

}  // namespace rtstdb::query
