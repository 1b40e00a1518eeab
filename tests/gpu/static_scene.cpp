#include "tests/gpu/static_scene.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace rtstdb::test {
namespace {

glm::dvec3 turned(const Motion& motion, WorldTime t, const glm::dvec3& arm_m) {
  const double rate_radps = glm::length(motion.w_world_radps);
  const glm::dvec3 initial_m = glm::normalize(motion.q_world) * arm_m;
  if (rate_radps == 0.0) return initial_m;
  // Rodrigues' formula.
  const glm::dvec3 axis = motion.w_world_radps / rate_radps;
  const double angle_rad = rate_radps * seconds_between(motion.valid_from, t);
  return std::cos(angle_rad) * initial_m + std::sin(angle_rad) * glm::cross(axis, initial_m) +
         (1.0 - std::cos(angle_rad)) * glm::dot(axis, initial_m) * axis;
}

/// In double precision.
struct Corners {
  glm::dvec3 a, b, c;
};

std::optional<double> lambda_at(const Corners& corners, const glm::dvec3& from_m,
                                const glm::dvec3& direction) {
  const glm::dvec3 normal = glm::cross(corners.b - corners.a, corners.c - corners.a);
  const double approach = glm::dot(direction, normal);
  if (approach == 0.0) return std::nullopt;
  const double lambda = glm::dot(corners.a - from_m, normal) / approach;
  const glm::dvec3 at_m = from_m + lambda * direction;
  const auto side = [&](const glm::dvec3& begin, const glm::dvec3& end) {
    return glm::dot(glm::cross(end - begin, at_m - begin), normal);
  };
  const bool inside = side(corners.a, corners.b) >= 0.0 && side(corners.b, corners.c) >= 0.0 &&
                      side(corners.c, corners.a) >= 0.0;
  return inside ? std::optional(lambda) : std::nullopt;
}

}  // namespace

glm::dvec3 world_point(const Motion& motion, WorldTime t, const glm::dvec3& point_m) {
  return motion.p_world_m + motion.v_world_mps * seconds_between(motion.valid_from, t) +
         turned(motion, t, point_m);
}

StaticScene static_scene(std::span<const EntityState> entities, std::span<const TriangleMesh> meshes,
                         WorldTime t) {
  StaticScene world;
  for (const EntityState& entity : entities) {
    const EntityRow& row = entity.row;
    const TriangleMesh& mesh = meshes[row.geometry.index];
    world.first.resize(entity.id.index + 1);
    world.first[entity.id.index] = static_cast<std::uint32_t>(world.mesh.triangles.size());
    const auto first_corner = static_cast<std::uint32_t>(world.mesh.positions_m.size());
    for (const glm::vec3& position_m : mesh.positions_m)
      world.mesh.positions_m.emplace_back(world_point(row.motion, t, row.scale * glm::dvec3(position_m)));
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      world.mesh.triangles.push_back(mesh.triangles[i] + first_corner);
      world.source.push_back({entity.id, i});
    }
  }
  return world;
}

Ray in_world(const Ray& ray, std::span<const EntityState> entities) {
  const auto carrier = std::ranges::find(entities, ray.carrier, &EntityState::id);
  if (carrier == entities.end()) return ray;
  const Motion& motion = carrier->row.motion;
  Ray moved = ray;
  moved.carrier = {};
  moved.origin_m = world_point(motion, ray.t, ray.origin_m);
  moved.direction = turned(motion, ray.t, ray.direction);
  return moved;
}

Intersection intersect(const StaticScene& world, std::uint32_t triangle, const Ray& ray, double error_m) {
  const glm::uvec3 numbers = world.mesh.triangles[triangle];
  const auto corner = [&](std::uint32_t number) { return glm::dvec3(world.mesh.positions_m[number]); };
  const Corners corners{corner(numbers.x), corner(numbers.y), corner(numbers.z)};
  const glm::dvec3 direction(ray.direction);
  const glm::dvec3 forward = glm::normalize(direction);
  const glm::dvec3 other = std::abs(forward.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, other));
  const glm::dvec3 up = glm::cross(forward, right);
  Intersection all{.always = true, .ever = false, .min_lambda = 1e300, .max_lambda = -1e300};
  const auto add_shifted = [&](const glm::dvec3& shift_m) {
    const auto lambda = lambda_at(corners, glm::dvec3(ray.origin_m) + shift_m, direction);
    all.always = all.always && lambda.has_value();
    if (!lambda) return;
    all.ever = true;
    all.min_lambda = std::min(all.min_lambda, *lambda);
    all.max_lambda = std::max(all.max_lambda, *lambda);
  };
  add_shifted(glm::dvec3(0.0));
  for (const double part : {0.25, 0.5, 1.0}) {
    for (int k = 0; k < 8; ++k) {
      const double angle_rad = 0.25 * std::numbers::pi * k;
      add_shifted(part * error_m * (std::cos(angle_rad) * right + std::sin(angle_rad) * up));
    }
  }
  return all;
}

}  // namespace rtstdb::test
