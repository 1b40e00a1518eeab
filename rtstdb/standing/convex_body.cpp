#include "rtstdb/standing/convex_body.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>

namespace rtstdb::standing {
namespace {

void add_corner(ConvexBody& body, const glm::dvec3& corner_m) {
  body.corners_m.add(corner_m);
  body.reach_m = std::max(body.reach_m, glm::length(corner_m));
}

}  // namespace

ConvexBody box_body(const glm::dvec3& center_m, const glm::dquat& q, const glm::dvec3& half_extent_m) {
  const glm::dmat3 axes = glm::mat3_cast(q);
  ConvexBody body;
  for (unsigned k = 0; k < 8; ++k) {
    glm::dvec3 corner_m = center_m;
    for (unsigned i = 0; i < 3; ++i) {
      const auto axis = static_cast<int>(i);
      corner_m += ((k >> i & 1u) != 0 ? 1.0 : -1.0) * half_extent_m[axis] * axes[axis];
    }
    add_corner(body, corner_m);
  }
  for (int i = 0; i < 3; ++i) {
    const double middle_m = glm::dot(axes[i], center_m);
    body.faces.add({axes[i], middle_m + half_extent_m[i]});
    body.faces.add({-axes[i], half_extent_m[i] - middle_m});
    body.normals.add(axes[i]);
    body.edges.add(axes[i]);
  }
  return body;
}

ConvexBody frustum_body(const glm::dvec3& eye_m, const glm::dquat& q, double near_m,
                        const glm::dvec3& far_half_extent_m) {
  const glm::dmat3 axes = glm::mat3_cast(q);
  const glm::dvec3 forward = axes[0];
  const double far_m = far_half_extent_m.x;
  const glm::dvec3 left_m = far_half_extent_m.y * axes[1];
  const glm::dvec3 up_m = far_half_extent_m.z * axes[2];
  ConvexBody body;
  for (unsigned k = 0; k < 8; ++k) {
    const double share = (k & 4u) != 0 ? 1.0 : near_m / far_m;
    const glm::dvec3 to_far_m =
        far_m * forward + ((k & 1u) != 0 ? left_m : -left_m) + ((k & 2u) != 0 ? up_m : -up_m);
    add_corner(body, eye_m + share * to_far_m);
    if ((k & 4u) != 0) body.edges.add(glm::normalize(to_far_m));
  }
  const auto add_face = [&](const glm::dvec3& outward, const glm::dvec3& on_it_m) {
    body.faces.add({outward, glm::dot(outward, on_it_m)});
  };
  add_face(forward, eye_m + far_m * forward);
  add_face(-forward, eye_m + near_m * forward);
  body.normals.add(forward);
  for (int side = 1; side <= 2; ++side) {
    for (const double sign : {1.0, -1.0}) {
      const glm::dvec3 outward =
          glm::normalize(sign * far_m * axes[side] - far_half_extent_m[side] * forward);
      add_face(outward, eye_m);
      body.normals.add(outward);
    }
    body.edges.add(axes[side]);
  }
  return body;
}

ConvexBody segment_body(const glm::dvec3& first_m, const glm::dvec3& last_m, const glm::dvec3& direction) {
  ConvexBody body;
  add_corner(body, first_m);
  add_corner(body, last_m);
  body.edges.add(direction);
  return body;
}

}  // namespace rtstdb::standing
