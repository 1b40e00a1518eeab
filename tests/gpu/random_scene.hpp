#pragma once
// Random rows, rays, regions and points from a seed, with every kind of mesh, motion, mask, carrier and
// range.

#include <span>
#include <vector>

#include <rtstdb/database.hpp>

#include "tests/support/random.hpp"

namespace rtstdb::test {

/// Boxes, spheres, cylinders, a flat rectangle, a single triangle, soups with degenerate triangles and with
/// triangles that share one center.
std::vector<TriangleMesh> mixed_meshes(Random& random);

struct SceneOptions {
  double radius_m = 10.0;  ///< standard deviation of positions
  WorldTime version_time{};
  bool still = false;  ///< entities do not move
};

/// Number of materials that entities of a scene have, the default material included.
constexpr std::uint32_t scene_materials = 5;

/// An entity that moves at up to 30 m/s and turns up to five times a second, since up to a minute before the
/// version. One in ten has exactly the position of one of `others`.
EntityRow random_row(Random& random, std::span<const GeometryId> geometries, const SceneOptions& options,
                     const std::vector<EntityRow>& others);

/// A ray at a time from `first` to `first + window_s`, in most cases towards one of the entities. One in four
/// has a carrier, some have a mask or a range of lambda, some run along an axis.
Ray random_ray(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
               WorldTime first, double window_s);

/// Eight neighbouring rays: origins within a centimetre, nearly one direction, each with its own time, mask
/// and range. One group in 24 is split after the third ray, or consists of eight unrelated rays.
std::vector<Ray> random_neighbours(Random& random, std::span<const EntityState> entities,
                                   const SceneOptions& options, WorldTime first, double window_s);

/// A cone about such a ray: one in eight has no opening, one in 32 is wide, the others are beams.
Cone random_cone(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                 WorldTime first, double window_s);

/// A camera that looks along such a ray, turned about it; one in two has a rolling shutter and an exposure.
Camera random_camera(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                     WorldTime first, double window_s);

/// Fills groups of eight elements with random_neighbours; the last group may be shorter.
void fill_with_neighbours(std::span<Ray> rays, Random& random, std::span<const EntityState> entities,
                          const SceneOptions& options, WorldTime first, double window_s);

Region random_region(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                     WorldTime first, double window_s);

/// A point among the entities, near a surface or far from all. Some have a carrier, a mask or a short radius.
Nearest random_point(Random& random, std::span<const EntityState> entities, const SceneOptions& options,
                     WorldTime first, double window_s);

/// In most cases a named pair or one entity against the others; one in 64 has all pairs of two masks.
/// Some have a margin or a mask.
ContactSearch random_contact_search(Random& random, std::span<const EntityState> entities, WorldTime first,
                                    double window_s);

/// A named pair or one entity against the others, for up to two seconds.
ImpactSearch random_impact_search(Random& random, std::span<const EntityState> entities, WorldTime first,
                                  double window_s);

}  // namespace rtstdb::test
