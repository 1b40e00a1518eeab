#pragma once
// A world at one instant as a single mesh that stands still, made by a formula of its own in double
// precision: what programs that know nothing of motion are asked about.

#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::test {

struct StillWorld {
  TriangleMesh mesh;                  ///< world frame, one entity after the other
  std::vector<EntityTriangle> whose;  ///< of each of its triangles
  std::vector<std::uint32_t> first;   ///< by entity index: its first triangle
};

/// `meshes`: by GeometryId::index. Entities by ascending index, all with a geometry.
StillWorld still_world(std::span<const EntityState> entities, std::span<const TriangleMesh> meshes,
                       WorldTime t);

/// A point of the entity's frame in the world.
glm::dvec3 stands_at(const Motion& motion, WorldTime t, const glm::dvec3& point_m);

/// The same ray in the world frame; without a carrier it is the ray itself.
Ray in_world(const Ray& ray, std::span<const EntityState> entities);

/// A ray in double precision that may be off by some distance to any side: where it meets a triangle.
struct Meeting {
  bool always = false;  ///< however far it is off
  bool ever = false;
  double min_lambda = 0.0, max_lambda = 0.0;
};
Meeting meeting(const StillWorld& world, std::uint32_t triangle, const Ray& ray, double off_m);

}  // namespace rtstdb::test
