#include "rtstdb/oracle/frustum.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <span>

namespace rtstdb::oracle {
namespace {

using Corners = std::array<glm::dvec3, 8>;

Corners corners_of(const Frustum& frustum) {
  Corners corners;
  for (unsigned k = 0; k < 8; ++k) {
    const double share = (k & 4u) != 0 ? 1.0 : frustum.near_m / frustum.far_m;
    const double left_m = (k & 1u) != 0 ? frustum.half_width_m : -frustum.half_width_m;
    const double up_m = (k & 2u) != 0 ? frustum.half_height_m : -frustum.half_height_m;
    corners[k] = frustum.eye_m + share * (frustum.far_m * frustum.axis[0] + left_m * frustum.axis[1] +
                                          up_m * frustum.axis[2]);
  }
  return corners;
}

Corners corners_of(const OrientedBox& box) {
  Corners corners;
  for (unsigned k = 0; k < 8; ++k) {
    corners[k] = box.center_m;
    for (unsigned i = 0; i < 3; ++i)
      corners[k] += ((k >> i & 1u) != 0 ? 1.0 : -1.0) * box.half_extent_m[static_cast<int>(i)] * box.axis[i];
  }
  return corners;
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

struct Span {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

Span span_of(const Corners& corners, const glm::dvec3& axis) {
  Span span;
  for (const glm::dvec3& corner : corners) {
    span.low = std::min(span.low, glm::dot(axis, corner));
    span.high = std::max(span.high, glm::dot(axis, corner));
  }
  return span;
}

}  // namespace

double separation_m(const Frustum& frustum, const OrientedBox& box) {
  const Corners ours = corners_of(frustum);
  const Corners theirs = corners_of(box);
  double largest = -std::numeric_limits<double>::infinity();
  const auto try_axis = [&](const glm::dvec3& axis) {
    const Span a = span_of(ours, axis);
    const Span b = span_of(theirs, axis);
    largest = std::max({largest, a.low - b.high, b.low - a.high});
  };
  for (const Face& face : faces_of(frustum))
    try_axis(face.outward);
  for (const glm::dvec3& axis : box.axis)
    try_axis(axis);
  const glm::dvec3 edges[] = {frustum.axis[1],
                              frustum.axis[2],
                              glm::normalize(ours[4] - frustum.eye_m),
                              glm::normalize(ours[5] - frustum.eye_m),
                              glm::normalize(ours[6] - frustum.eye_m),
                              glm::normalize(ours[7] - frustum.eye_m)};
  for (const glm::dvec3& edge : edges) {
    for (const glm::dvec3& axis : box.axis) {
      const glm::dvec3 across = glm::cross(edge, axis);
      const double sine = glm::length(across);
      // Parallel edges span no direction of their own: the faces' directions have looked there already.
      if (sine > 1e-10) try_axis(across / sine);
    }
  }
  return largest;
}

double sticks_out_m(const OrientedBox& box, const Frustum& frustum) {
  double most = -std::numeric_limits<double>::infinity();
  const Corners corners = corners_of(box);
  for (const Face& face : faces_of(frustum))
    most = std::max(most, span_of(corners, face.outward).high - face.offset_m);
  return most;
}

}  // namespace rtstdb::oracle
