#include "rtstdb/oracle/frustum.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <limits>

namespace rtstdb::oracle {
namespace {

glm::dvec3 corner_m(const Frustum& frustum, unsigned k) {
  const double share = (k & 4u) != 0 ? 1.0 : frustum.near_m / frustum.far_m;
  const double left_m = (k & 1u) != 0 ? frustum.half_width_m : -frustum.half_width_m;
  const double up_m = (k & 2u) != 0 ? frustum.half_height_m : -frustum.half_height_m;
  return frustum.eye_m +
         share * (frustum.far_m * frustum.axis[0] + left_m * frustum.axis[1] + up_m * frustum.axis[2]);
}

struct Face {
  glm::dvec3 outward;  // unit
  double offset_m = 0.0;
};

std::array<Face, 6> faces_of(const Frustum& frustum) {
  const auto& [forward, left, up] = frustum.axis;
  const auto through_eye = [&](const glm::dvec3& normal) {
    const glm::dvec3 outward = glm::normalize(normal);
    return Face{outward, glm::dot(outward, frustum.eye_m)};
  };
  const double eye_m = glm::dot(forward, frustum.eye_m);
  return {Face{-forward, -eye_m - frustum.near_m},
          Face{forward, eye_m + frustum.far_m},
          through_eye(frustum.far_m * left - frustum.half_width_m * forward),
          through_eye(-frustum.far_m * left - frustum.half_width_m * forward),
          through_eye(frustum.far_m * up - frustum.half_height_m * forward),
          through_eye(-frustum.far_m * up - frustum.half_height_m * forward)};
}

}  // namespace

Polyhedron polyhedron_of(const Frustum& frustum) {
  Polyhedron body;
  for (unsigned k = 0; k < 8; ++k)
    body.corners_m.add(corner_m(frustum, k));
  for (const Face& face : faces_of(frustum))
    body.normals.add(face.outward);
  body.edges.add(frustum.axis[1]);
  body.edges.add(frustum.axis[2]);
  for (unsigned k = 4; k < 8; ++k)
    body.edges.add(glm::normalize(corner_m(frustum, k) - frustum.eye_m));
  return body;
}

double separation_m(const Frustum& frustum, const OrientedBox& box) {
  return separation_m(polyhedron_of(frustum), polyhedron_of(box));
}

double sticks_out_m(const Points<8>& corners_m, const Frustum& frustum) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Face& face : faces_of(frustum)) {
    for (const glm::dvec3& corner : corners_m)
      most = std::max(most, glm::dot(face.outward, corner) - face.offset_m);
  }
  return most;
}

double sticks_out_m(const OrientedBox& box, const Frustum& frustum) {
  return sticks_out_m(polyhedron_of(box).corners_m, frustum);
}

}  // namespace rtstdb::oracle
