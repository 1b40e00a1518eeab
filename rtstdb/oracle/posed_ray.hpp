#pragma once
// A ray and the entities, at the ray's time. Internal to the oracle.

#include <glm/ext/vector_double3.hpp>

#include <array>

#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {

struct PosedEntity {
  const EntityState* state = nullptr;
  const MeshTree* mesh = nullptr;  ///< null for an entity without geometry
  Pose pose;
  double dt_s = 0.0;  ///< since the row is written down in single precision (shaders/shared/entity.h)

  std::array<glm::dvec3, 3> corners_world(std::uint32_t triangle) const noexcept;
  double reach() const noexcept { return reach_m(mesh->bounds(), state->row.scale); }
};

struct PosedRay {
  glm::dvec3 origin_m{0.0};
  glm::dvec3 direction{0.0};
  double length = 0.0;  ///< of the direction: metres per unit of lambda
  glm::dvec3 v_origin_mps{0.0};
  double lambda_min = 0.0, lambda_max = 0.0;
  double noise_units_m = 0.0;      ///< magnitudes that every point of the ray shares
  double noise_units_per_m = 1.0;  ///< and those that grow along it

  PosedRay(const World& world, const Ray& ray, bool ignore_motion);
  LocalRay in_frame_of(const PosedEntity& entity) const noexcept;
  /// False: the entity's bounding sphere is farther than `margin_m` from the ray's line.
  bool passes(const PosedEntity& entity, double margin_m) const noexcept;
  /// The noise, in single precision, of the ray's point at `lambda` relative to a part of the entity that is
  /// `arm_m` from the entity's origin.
  double noise_m(const PosedEntity& entity, double lambda, double arm_m) const noexcept;
};

/// Whether a query with this mask sees the entity.
bool visible(const EntityState& state, std::uint32_t mask) noexcept;

PosedEntity posed(const World& world, const EntityState& state, WorldTime t, bool ignore_motion) noexcept;

/// Noise of the entity's own pose, in metres of magnitude: multiply by noise_factor * 2^-24.
double noise_units_m(const EntityState& state, const Pose& pose, double dt_s, double arm_m) noexcept;

inline constexpr double noise_per_unit = noise_factor / 16777216.0;

}  // namespace rtstdb::oracle
