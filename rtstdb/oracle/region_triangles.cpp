// Regions by triangle: tests every triangle of every entity that is near.

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "rtstdb/oracle/nearest_point.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/polyhedron.hpp"
#include "rtstdb/oracle/posed_ray.hpp"
#include "rtstdb/oracle/posed_region.hpp"

namespace rtstdb::oracle {
namespace {

using Triangle = std::array<glm::dvec3, 3>;

/// The gap of triangles to one region.
class TriangleMeasure {
 public:
  TriangleMeasure(const World& world, const Region& region)
      : region_(region), at_(posed_region(world, region)), frustum_(frustum_of(region, at_.box)) {
    if (region.shape == RegionShape::box) body_ = polyhedron_of(at_.box);
    if (region.shape == RegionShape::frustum) body_ = polyhedron_of(frustum_);
  }

  double noise_units() const { return at_.noise_units; }

  /// The radius of a sphere around the region's centre that contains the region.
  double reach_m() const {
    return region_.shape == RegionShape::sphere ? at_.box.half_extent_m.x
                                                : glm::length(at_.box.half_extent_m);
  }
  const glm::dvec3& center_m() const { return at_.box.center_m; }

  /// As EntityGap::gap_m. A result above `enough_m` may be less than the gap.
  double gap_m(const Triangle& triangle_m, double enough_m) const {
    const bool inside = region_.test == RegionTest::inside;
    if (region_.shape == RegionShape::sphere) {
      const double radius_m = at_.box.half_extent_m.x;
      return (inside ? farthest_corner_m(triangle_m)
                     : glm::length(nearest_on_triangle(triangle_m, center_m()).point - center_m())) -
             radius_m;
    }
    if (!inside) return separation_m(*body_, polyhedron_of(triangle_m), enough_m);
    return region_.shape == RegionShape::frustum ? sticks_out_m(polyhedron_of(triangle_m).corners_m, frustum_)
                                                 : sticks_out_of_box_m(triangle_m);
  }

 private:
  double farthest_corner_m(const Triangle& triangle_m) const {
    double most = 0.0;
    for (const glm::dvec3& corner_m : triangle_m)
      most = std::max(most, glm::length(corner_m - center_m()));
    return most;
  }
  double sticks_out_of_box_m(const Triangle& triangle_m) const {
    double most = -std::numeric_limits<double>::infinity();
    for (const glm::dvec3& corner_m : triangle_m) {
      for (int i = 0; i < 3; ++i)
        most = std::max(
            most, std::abs(glm::dot(at_.box.axis[i], corner_m - center_m())) - at_.box.half_extent_m[i]);
    }
    return most;
  }

  const Region& region_;
  PosedRegion at_;
  Frustum frustum_;
  std::optional<Polyhedron> body_;
};

/// One visible entity: a lower bound of its distance, and its noise.
struct Candidate {
  PosedEntity entity;
  double noise_m = 0.0;
  double at_least_m = 0.0;
};

template <class Visit>
void each_visible(const World& world, const Region& region, const TriangleMeasure& measure, Visit visit) {
  for (const EntityState& state : world.entities()) {
    if (!visible(state, region.mask)) continue;
    Candidate candidate{.entity = posed(world, state, region.t, false)};
    const PosedEntity& entity = candidate.entity;
    candidate.noise_m = noise_per_unit * (measure.noise_units() +
                                          noise_units_m(state, entity.pose, entity.dt_s, entity.reach()));
    candidate.at_least_m =
        glm::length(entity.pose.p_world_m - measure.center_m()) - entity.reach() - measure.reach_m();
    visit(candidate);
  }
}

}  // namespace

std::vector<TriangleGap> triangle_gaps(const World& world, const Region& region) {
  const TriangleMeasure measure(world, region);
  std::vector<TriangleGap> all;
  each_visible(world, region, measure, [&](const Candidate& candidate) {
    const double noise_m = candidate.noise_m;
    if (candidate.at_least_m > 2.0 * noise_m) return;
    for (std::uint32_t i = 0; i < candidate.entity.mesh->triangle_count(); ++i) {
      const double gap_m = measure.gap_m(candidate.entity.corners_world(i), noise_m);
      if (gap_m <= noise_m) all.push_back({candidate.entity.state->id, i, gap_m, noise_m});
    }
  });
  return all;
}

std::vector<EntityGap> surface_gaps(const World& world, const Region& region) {
  const TriangleMeasure measure(world, region);
  const bool inside = region.test == RegionTest::inside;
  std::vector<EntityGap> all;
  each_visible(world, region, measure, [&](const Candidate& candidate) {
    EntityGap gap{candidate.entity.state->id, candidate.at_least_m, candidate.noise_m};
    if (candidate.at_least_m <= 2.0 * candidate.noise_m) {
      gap.gap_m = (inside ? -1.0 : 1.0) * std::numeric_limits<double>::infinity();
      for (std::uint32_t i = 0; i < candidate.entity.mesh->triangle_count(); ++i) {
        const double one_m = measure.gap_m(candidate.entity.corners_world(i), candidate.noise_m);
        gap.gap_m = inside ? std::max(gap.gap_m, one_m) : std::min(gap.gap_m, one_m);
      }
    }
    all.push_back(gap);
  });
  return all;
}

}  // namespace rtstdb::oracle
