#pragma once
// Truths and answers in single precision for the tests of contacts of concave bodies.

#include <algorithm>
#include <array>

#include "contact_scene.hpp"
#include "rtstdb/oracle/contact_surface.hpp"
#include "tests/support/concave_meshes.hpp"

namespace rtstdb::oracle {

inline SurfaceTruth surface_truth_of(const Scene& scene) {
  return surface_truth(scene.world(), first_id, second_id, {});
}

/// Velocity of the first body minus that of the second at a point relative to the first one's origin.
inline glm::vec3 surface_velocity_of(const SurfacePair& pair, const glm::dvec3& p_first_m) {
  const Motion& first = pair.first.state->row.motion;
  const Motion& second = pair.second.state->row.motion;
  const glm::dvec3 p_second_m = p_first_m + pair.first.pose.p_world_m - pair.second.pose.p_world_m;
  return glm::vec3(first.v_world_mps + glm::cross(first.w_world_radps, p_first_m) - second.v_world_mps -
                   glm::cross(second.w_world_radps, p_second_m));
}

/// The truth in single precision, with the deepest or nearest point; the depth is the least that the truth
/// may have.
inline ContactPair rounded_surfaces(const SurfacePair& pair, const SurfaceTruth& truth,
                                    const ContactSearch& search) {
  const auto margin_m = static_cast<double>(search.margin_m);
  ContactPair answer;
  answer.first = pair.first.state->id;
  answer.second = pair.second.state->id;
  answer.has_depth = truth.has_depth;
  answer.status = truth.is_contact               ? PairStatus::contact
                  : truth.distance_m <= margin_m ? PairStatus::near
                                                 : PairStatus::separate;
  const double depth_m = truth.is_contact ? truth.min_depth_m : -truth.distance_m;
  answer.distance_m = answer.min_distance_m = answer.max_distance_m = static_cast<float>(-depth_m);
  // Of a contact, the point of the first surface is below that of the second along the normal.
  const glm::dvec3 from_first_m = truth.p_second_m - truth.p_first_m;
  const glm::dvec3 n = depth_m == 0.0 ? glm::dvec3(0.0, 0.0, 1.0)
                                      : (depth_m > 0.0 ? 1.0 : -1.0) * glm::normalize(from_first_m);
  answer.n_world = glm::vec3(n);
  if (answer.status == PairStatus::separate) return answer;
  answer.point_count = 1;
  const glm::dvec3 p_m = 0.5 * (truth.p_first_m + truth.p_second_m);
  answer.points[0] = {.p_first_m = glm::vec3(p_m),
                      .n_world = answer.n_world,
                      .depth_m = static_cast<float>(depth_m),
                      .first_triangle = truth.first_triangle,
                      .second_triangle = truth.second_triangle,
                      .v_relative_mps = surface_velocity_of(pair, p_m)};
  return answer;
}

/// Moving concave bodies of all kinds, in pairs of which about half touch: entities 0 and 1, 2 and 3, ...
inline Scene concave_pairs(std::uint64_t seed, int count) {
  Random random(seed);
  Scene scene;
  const std::array<GeometryId, 6> shapes{scene.add(test::make_torus(1.0, 0.3, 16)),
                                         scene.add(test::make_bowl(1.0, 0.8, 20)),
                                         scene.add(test::make_gear(1.0, 0.75, 0.4, 0.4, 10)),
                                         scene.add(test::make_l_shape(1.2, 0.4, 0.6)),
                                         scene.add(make_sphere(0.7, 2)),
                                         scene.add(test::make_wavy_sheet(1.6, 0.2, 10))};
  for (int i = 0; i < 2 * count; ++i) {
    // The first body of each pair is not convex.
    EntityRow& row = scene.place(shapes[random.below(i % 2 == 0 ? 4 : 6)]);
    row.scale = {random.magnitude(0.6, 1.6), random.magnitude(0.6, 1.6), random.magnitude(0.6, 1.6)};
    const int pair = i / 2;
    row.motion.p_world_m = {20.0 * pair, 100.0, -50.0};
    if (i % 2 == 1) row.motion.p_world_m += random.uniform(0.2, 2.2) * random.direction();
    row.motion.q_world = random.orientation();
    row.motion.v_world_mps = random.vector();
    row.motion.w_world_radps = random.vector();
  }
  return scene;
}

}  // namespace rtstdb::oracle
