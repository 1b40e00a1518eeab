#pragma once
// The box that an entity's oriented bounds stay in over a window of time: the reference, in double precision,
// for the boxes that the GPU puts into its tree with what stands out of them. Those boxes are around the entity's
// triangles (extents.hpp), by the same proof. Pure functions: any thread, no allocation.
//
// Why the union of the two end boxes is not enough, and what is:
//
// A corner r of the bounds (scaled, seen from the entity's origin, |r| <= rho) stands at c(t) = p(t) + R(t)
// r, where p is linear in t and R turns with the constant w. So c'' = w x (w x R r), and along axis i
//     |c_i''| <= |w|^2 |r_perp . e_i| <= rho |w|^2 sqrt(1 - w_i^2 / |w|^2) = rho |w| sqrt(|w|^2 - w_i^2)
// since r_perp, the part of R r square to w, only meets the part of e_i that is square to w as well.
// A function leaves its chord over [t0, t1] by at most (t1 - t0)^2 max|f''| / 8 (linear interpolation), and
// the chord lies within the corner's two end values, thus in the union of the exact end boxes. Hence (a):
//     that union, grown along axis i by  rho |w| sqrt(|w|^2 - w_i^2) (t1 - t0)^2 / 8
// which is rho phi^2 / 8 square to the axis of rotation, phi = |w| (t1 - t0), and nothing along it.
// And no corner is ever farther than rho from the moving origin. Hence (b):
//     the union of the two origins, grown by rho
// Every point of the bounds is a convex mixture of corners, so both hold for the whole body, and so does the
// tighter of the two, taken bound by bound: (a) for small turns, (b) for large ones. Rounding is covered by a
// pad of some units in the last place of the largest quantity that takes part.

#include <glm/ext/vector_double3.hpp>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// An axis-parallel box in the world, metres.
struct WorldBox {
  glm::dvec3 minimum_m{0.0};
  glm::dvec3 maximum_m{0.0};
};

/// The oriented bounds of an entity at one instant, world frame: the geometry's box, scaled and posed.
struct OrientedBox {
  glm::dvec3 center_m{0.0};
  glm::dvec3 axis[3]{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};  ///< unit, pairwise square
  glm::dvec3 half_extent_m{0.0};
};

OrientedBox oriented_box(const Bounds& bounds, const glm::dvec3& scale, const Pose& pose) noexcept;

/// The smallest axis-parallel box around an oriented one.
WorldBox box_around(const OrientedBox& box) noexcept;

/// rho: the largest distance of a scaled corner of the bounds from the entity's origin, its centre of
/// rotation.
double reach_m(const Bounds& bounds, const glm::dvec3& scale) noexcept;

/// Contains the entity's oriented bounds at every t in [t0, t1]. t0 <= t1 (misuse asserts); for t0 == t1 it
/// is the exact box but for the pad.
WorldBox motion_bounds(const Bounds& bounds, const glm::dvec3& scale, const Motion& motion, WorldTime t0,
                       WorldTime t1) noexcept;

}  // namespace rtstdb
