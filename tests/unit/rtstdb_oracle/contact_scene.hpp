#pragma once
// Searches, moving hulls and answers in single precision for the tests of contacts.

#include <glm/gtc/quaternion.hpp>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "rtstdb/oracle/contact_pair.hpp"
#include "rtstdb/oracle/nearest_point.hpp"
#include "scene.hpp"
#include "tests/support/hull_meshes.hpp"

namespace rtstdb::oracle {

inline constexpr EntityId first_id{0, 1};
inline constexpr EntityId second_id{1, 1};

inline ContactSearch search_of(EntityId first, EntityId second = {}, float margin_m = 0.0f) {
  ContactSearch search;
  search.first = first;
  search.second = second;
  search.margin_m = margin_m;
  return search;
}

/// Two bodies; the first one is at the origin.
inline Scene two_bodies(TriangleMesh first, TriangleMesh second, const glm::dvec3& second_at_m,
                        const glm::dquat& second_q = {1.0, 0.0, 0.0, 0.0}) {
  Scene scene;
  scene.place(std::move(first));
  scene.place(std::move(second), at(second_at_m)).motion.q_world = second_q;
  return scene;
}

inline PairTruth truth_of(const Scene& scene, WorldTime t = {}) {
  return pair_truth(scene.world(), first_id, second_id, t);
}

/// Moving and turning hulls of 4 to 24 corners around the origin. `spread_m` is how far they lie apart.
inline Scene hull_crowd(std::uint64_t seed, int count, double spread_m) {
  Random random(seed);
  Scene scene;
  scene.version_time = at_s(10.0);
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 half_axes_m{random.magnitude(0.3, 3.0), random.magnitude(0.3, 3.0),
                                 random.magnitude(0.3, 3.0)};
    const auto corners = static_cast<std::uint32_t>(4 + random.below(21));
    EntityRow& row = scene.place(test::make_random_hull(random.engine(), corners, half_axes_m));
    row.scale = {random.magnitude(0.5, 2.0), random.magnitude(0.5, 2.0), random.magnitude(0.5, 2.0)};
    row.mask = 1u << random.below(3);
    row.motion.p_world_m = spread_m * random.vector();
    row.motion.q_world = random.orientation();
    row.motion.valid_from = at_s(random.uniform(9.0, 10.0));
    row.motion.v_world_mps = 0.3 * random.vector();
    row.motion.w_world_radps = random.magnitude(0.1, 5.0) * random.direction();
  }
  return scene;
}

/// The triangle of the body that is nearest to the point.
inline std::uint32_t triangle_at(const ConvexBody& body, const glm::dvec3& point_m) {
  std::uint32_t best = 0;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < body.triangles_m.size(); ++i) {
    const double off_m = glm::distance(nearest_on_triangle(body.triangles_m[i], point_m).point, point_m);
    if (off_m >= nearest_m) continue;
    nearest_m = off_m;
    best = i;
  }
  return best;
}

/// Velocity of the first body minus that of the second at a point relative to the first one's origin.
inline glm::vec3 relative_velocity_of(const PosedPair& pair, const glm::dvec3& p_first_m) {
  const Motion& first = pair.first.state->row.motion;
  const Motion& second = pair.second.state->row.motion;
  const glm::dvec3 p_second_m = p_first_m + pair.first.pose.p_world_m - pair.second.pose.p_world_m;
  return glm::vec3(first.v_world_mps + glm::cross(first.w_world_radps, p_first_m) - second.v_world_mps -
                   glm::cross(second.w_world_radps, p_second_m));
}

/// The contact point between these points of the surfaces, the second one farther along the normal by the
/// depth.
inline ContactPoint contact_between(const PosedPair& pair, const glm::dvec3& on_first_m,
                                    const glm::dvec3& on_second_m, double depth_m) {
  const glm::dvec3 p_m = 0.5 * (on_first_m + on_second_m);
  ContactPoint point;
  point.p_first_m = glm::vec3(p_m);
  point.depth_m = static_cast<float>(depth_m);
  point.first_triangle = triangle_at(pair.first_body, on_first_m);
  point.second_triangle = triangle_at(pair.second_body, on_second_m);
  point.v_relative_mps = relative_velocity_of(pair, p_m);
  return point;
}

/// The truth in single precision, with the deepest or nearest point.
inline ContactPair rounded(const World& world, const ContactSearch& search, EntityId first, EntityId second) {
  const PosedPair pair = posed_pair(world, first, second, search.t);
  const PairTruth truth = pair_truth(pair);
  glm::dvec3 on_first_m = truth.p_first_m;
  glm::dvec3 on_second_m = truth.p_second_m;
  if (truth.distance_m <= 0.0) {
    // Moved apart by the depth, the bodies touch at one point.
    ConvexBody moved = pair.first_body;
    const glm::dvec3 by_m = -truth.distance_m * truth.n_world;
    for (glm::dvec3& p : moved.corners_m)
      p += by_m;
    for (ConvexBody::Face& face : moved.faces)
      for (glm::dvec3& p : face.corners_m)
        p += by_m;
    for (ConvexBody::Edge& edge : moved.edges)
      for (glm::dvec3& p : edge.ends_m)
        p += by_m;
    const BodyDistance touching = surface_distance(moved, pair.second_body);
    on_first_m = touching.p_first_m - by_m;
    on_second_m = touching.p_second_m;
  }
  const auto margin_m = static_cast<double>(search.margin_m);
  ContactPair answer;
  answer.first = first;
  answer.second = second;
  answer.status = truth.distance_m <= 0.0        ? PairStatus::contact
                  : truth.distance_m <= margin_m ? PairStatus::near
                                                 : PairStatus::separate;
  answer.distance_m = static_cast<float>(truth.distance_m);
  answer.min_distance_m = std::nextafter(answer.distance_m, -INFINITY);
  answer.max_distance_m = std::nextafter(answer.distance_m, INFINITY);
  answer.n_world = glm::vec3(truth.n_world);
  answer.point_count = answer.status == PairStatus::separate ? 0 : 1;
  answer.points[0] = contact_between(pair, on_first_m, on_second_m, -truth.distance_m);
  answer.points[0].n_world = answer.n_world;
  return answer;
}

}  // namespace rtstdb::oracle
