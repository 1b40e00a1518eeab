#pragma once
// Seeded worlds and questions that leave nothing out: every kind of mesh, motion, mask, carrier and range.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <random>
#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::test {

struct Random {
  std::mt19937_64 engine;
  explicit Random(std::uint64_t seed) : engine(seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(engine); }
  /// Spread evenly over the orders of magnitude.
  double magnitude(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(engine); }
  double normal() { return std::normal_distribution<double>()(engine); }
  bool one_in(std::size_t n) { return below(n) == 0; }
  glm::dvec3 vector();  ///< of normally distributed components
  glm::dvec3 direction() { return glm::normalize(vector()); }
  glm::dquat orientation() { return glm::angleAxis(uniform(0.0, 6.28), direction()); }
};

/// Boxes, spheres, cylinders, a flat rectangle, a single triangle, soups with degenerate triangles and with
/// triangles that share one centre.
std::vector<TriangleMesh> mixed_meshes(Random& random);

/// Entities and rays live within some multiples of this.
struct SceneOptions {
  double radius_m = 10.0;
  WorldTime version_time{};
  bool still = false;  ///< nobody moves
};

/// A row anywhere in the scene, moving at up to 30 m/s and turning at up to five turns a second since up to a
/// minute before the version. `beside`: one of them in ten shares its place exactly.
EntityRow random_row(Random& random, std::span<const GeometryId> geometries, const SceneOptions& options,
                     const std::vector<EntityRow>& beside);

/// A ray asked between `first` and `first + window_s`, most often at one of the entities; one in four is
/// carried, some see only a part of the world or of the way, some run along an axis.
Ray random_ray(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
               WorldTime first, double window_s);

/// Eight such rays that run side by side: from within a centimetre of one place, each into a direction, with
/// a time, a mask and a range of its own. Of 24 such groups one parts after the third, or is of eight that
/// stand anywhere.
std::vector<Ray> random_neighbours(Random& random, std::span<const EntityState> entities,
                                   const SceneOptions& options, WorldTime first, double window_s);

/// A cone about such a ray: one in eight has no opening, one in 32 is wide, the others are beams.
Cone random_cone(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                 WorldTime first, double window_s);

Region random_region(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                     WorldTime first, double window_s);

/// A point among the entities, as often near a surface as far from everything; some are carried, some look at
/// a part of the world or not far.
Nearest random_point(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                     WorldTime first, double window_s);

}  // namespace rtstdb::test
