#include "rtstdb/oracle/surface_approach.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <limits>

#include "rtstdb/oracle/posed_ray.hpp"
#include "rtstdb/oracle/surface_body.hpp"
#include "rtstdb/oracle/surface_pair.hpp"

namespace rtstdb::oracle {
namespace {

/// Half of the shortest interval of time that is divided.
constexpr double min_half_s = 0.25e-9;

/// A body in its entity's frame, scaled, and how it moves.
struct MovingSurface {
  SurfaceBody body;
  Motion motion;
  double turning_radps = 0.0;

  MovingSurface(const World& world, EntityId id)
      : body(unposed(world, id), false, glm::dvec3(0.0)),
        motion(world.find(id)->row.motion),
        turning_radps(glm::length(motion.w_world_radps)) {}

 private:
  static PosedEntity unposed(const World& world, EntityId id) {
    PosedEntity entity = posed(world, *world.find(id), {}, false);
    entity.pose = {};
    return entity;
  }
};

glm::dvec3 center_of(const SurfaceBox& box) {
  return 0.5 * (box.minimum_m + box.maximum_m);
}

double radius_of(const SurfaceBox& box) {
  return 0.5 * glm::distance(box.minimum_m, box.maximum_m);
}

/// The distance of a triangle from the plane of another one; 0 where it crosses the plane.
double beyond_plane_m(const SurfaceTriangle& triangle, const SurfaceTriangle& of_plane) {
  const glm::dvec3 normal = glm::cross(of_plane[1] - of_plane[0], of_plane[2] - of_plane[0]);
  const double length = glm::length(normal);
  if (!(length > 0.0)) return 0.0;
  std::array<double, 3> heights_m{};
  for (std::size_t i = 0; i < 3; ++i)
    heights_m[i] = glm::dot(triangle[i] - of_plane[0], normal) / length;
  const auto [min_m, max_m] = std::ranges::minmax(heights_m);
  return std::max({min_m, -max_m, 0.0});
}

class ApproachSearch {
 public:
  ApproachSearch(const MovingSurface& first, const MovingSurface& second, WorldTime t, double level_m)
      : first_(first),
        second_(second),
        p_m_(pose_at(first.motion, t).p_world_m - pose_at(second.motion, t).p_world_m),
        v_mps_(first.motion.v_world_mps - second.motion.v_world_mps),
        q_first_(pose_at(first.motion, t).q_world),
        q_second_(pose_at(second.motion, t).q_world),
        level_m_(level_m) {}

  std::optional<double> search(double end_s) const { return search(0, 0, at(0.5 * end_s, 0.5 * end_s)); }

 private:
  /// An interval of time, and the poses in its middle relative to the second origin.
  struct Interval {
    double middle_s = 0.0, half_s = 0.0;
    glm::dvec3 p_m{0.0};
    glm::dquat q_first{}, q_second{};
  };

  static glm::dquat turned(const glm::dquat& q, const MovingSurface& surface, double s) {
    if (surface.turning_radps == 0.0) return q;
    return glm::angleAxis(surface.turning_radps * s, surface.motion.w_world_radps / surface.turning_radps) *
           q;
  }
  Interval at(double middle_s, double half_s) const {
    return {middle_s, half_s, p_m_ + middle_s * v_mps_, turned(q_first_, first_, middle_s),
            turned(q_second_, second_, middle_s)};
  }

  std::optional<double> search(std::uint32_t a, std::uint32_t b, const Interval& interval) const {
    const SurfaceBody::Node& of_first = first_.body.nodes()[a];
    const SurfaceBody::Node& of_second = second_.body.nodes()[b];
    const glm::dvec3 center_a_m = center_of(of_first.box), center_b_m = center_of(of_second.box);
    const double radius_a_m = radius_of(of_first.box), radius_b_m = radius_of(of_second.box);
    // No point of a node moves farther in half of the interval.
    const double moves_m = interval.half_s * (glm::length(v_mps_) +
                                              first_.turning_radps * (glm::length(center_a_m) + radius_a_m) +
                                              second_.turning_radps * (glm::length(center_b_m) + radius_b_m));
    const double centers_m =
        glm::distance(interval.q_first * center_a_m + interval.p_m, interval.q_second * center_b_m);
    if (centers_m - radius_a_m - radius_b_m - moves_m >= level_m_) return std::nullopt;
    const bool a_is_leaf = of_first.count > 0, b_is_leaf = of_second.count > 0;
    if (a_is_leaf && b_is_leaf && moves_m > std::max(radius_a_m, radius_b_m)) return halves(a, b, interval);
    if (a_is_leaf && b_is_leaf) {
      const double distance_m = leaves_apart_m(of_first, of_second, interval, level_m_ + moves_m);
      if (distance_m < level_m_) return interval.middle_s;
      if (distance_m - moves_m >= level_m_) return std::nullopt;
      return halves(a, b, interval);
    }
    if (moves_m > std::max(a_is_leaf ? 0.0 : radius_a_m, b_is_leaf ? 0.0 : radius_b_m))
      return halves(a, b, interval);
    const bool splits_a = b_is_leaf || (!a_is_leaf && radius_a_m >= radius_b_m);
    for (std::uint32_t child = 0; child < 2; ++child) {
      const auto found = splits_a ? search(of_first.first + child, b, interval)
                                  : search(a, of_second.first + child, interval);
      if (found) return found;
    }
    return std::nullopt;
  }

  std::optional<double> halves(std::uint32_t a, std::uint32_t b, const Interval& interval) const {
    const double half_s = 0.5 * interval.half_s;
    if (half_s < min_half_s) return std::nullopt;
    if (const auto found = search(a, b, at(interval.middle_s - half_s, half_s))) return found;
    return search(a, b, at(interval.middle_s + half_s, half_s));
  }

  /// Returns any distance that is not below `far_m` where the triangles are farther apart than that.
  double leaves_apart_m(const SurfaceBody::Node& a, const SurfaceBody::Node& b, const Interval& interval,
                        double far_m) const {
    double min_m = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = a.first; i < a.first + a.count; ++i) {
      SurfaceTriangle of_first = first_.body.triangles()[first_.body.order()[i]];
      for (glm::dvec3& corner : of_first)
        corner = interval.q_first * corner + interval.p_m;
      for (std::uint32_t k = b.first; k < b.first + b.count; ++k) {
        SurfaceTriangle of_second = second_.body.triangles()[second_.body.order()[k]];
        for (glm::dvec3& corner : of_second)
          corner = interval.q_second * corner;
        const double planes_m =
            std::max(beyond_plane_m(of_first, of_second), beyond_plane_m(of_second, of_first));
        min_m = std::min(min_m, planes_m > far_m ? planes_m : triangles_apart_m(of_first, of_second));
      }
    }
    return min_m;
  }

  const MovingSurface& first_;
  const MovingSurface& second_;
  const glm::dvec3 p_m_, v_mps_;
  const glm::dquat q_first_, q_second_;
  const double level_m_;
};

}  // namespace

std::optional<double> time_nearer_than(const World& world, const ImpactSearch& search, EntityId second,
                                       double level_m, double end_s) {
  const MovingSurface of_first(world, search.first);
  const MovingSurface of_second(world, second);
  return ApproachSearch(of_first, of_second, search.t, level_m).search(end_s);
}

}  // namespace rtstdb::oracle
