#pragma once
// Distances of other bodies from a frustum, in double precision.

#include "rtstdb/geometry/motion_bounds.hpp"
#include "rtstdb/oracle/polyhedron.hpp"

namespace rtstdb::oracle {

/// The space in front of the eye between two distances; at the far one it extends half_width_m and
/// half_height_m to each side.
struct Frustum {
  glm::dvec3 eye_m{0.0};
  glm::dvec3 axis[3]{
      {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};  ///< forward, left, up: as OrientedBox
  double near_m = 0.0;
  double far_m = 0.0;  ///< above zero
  double half_width_m = 0.0;
  double half_height_m = 0.0;
};

Polyhedron polyhedron_of(const Frustum& frustum);

/// The largest gap along any axis that could separate them, negative when they overlap.
double separation_m(const Frustum& frustum, const OrientedBox& box);

/// How far the corners reach beyond the frustum's faces; not above zero when they lie inside.
double sticks_out_m(const Points<8>& corners_m, const Frustum& frustum);
double sticks_out_m(const OrientedBox& box, const Frustum& frustum);

}  // namespace rtstdb::oracle
