#pragma once
// A world at one instant as a single fixed mesh, for programs without motion. Its poses are computed here, in
// double precision, independently of the database.

#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::test {

struct StaticScene {
  TriangleMesh mesh;                   ///< world frame, one entity after the other
  std::vector<EntityTriangle> source;  ///< by triangle
  std::vector<std::uint32_t> first;    ///< by entity index: its first triangle
};

/// `meshes`: by GeometryId::index. Entities by ascending index, all with a geometry.
StaticScene static_scene(std::span<const EntityState> entities, std::span<const TriangleMesh> meshes,
                         WorldTime t);

/// The point of an entity, `point_m` in its frame, in the world frame.
glm::dvec3 world_point(const Motion& motion, WorldTime t, const glm::dvec3& point_m);

/// The ray in the world frame.
Ray in_world(const Ray& ray, std::span<const EntityState> entities);

/// Intersections of a triangle with rays that are shifted by up to an error to any side.
struct Intersection {
  bool always = false;  ///< each shifted ray hits
  bool ever = false;    ///< some shifted ray hits
  double min_lambda = 0.0, max_lambda = 0.0;
};
Intersection intersect(const StaticScene& world, std::uint32_t triangle, const Ray& ray, double error_m);

}  // namespace rtstdb::test
