#pragma once
// Bounds of a moving entity over a time window: a box that contains the entity's oriented bounds at every
// instant. The reference, in double precision, for the boxes that the GPU puts into its tree with the
// rounding errors they add. The GPU's boxes enclose the entity's triangles (extents.hpp), by the same proof.
// Pure functions: any thread, no allocation.
//
// Why the union of the two end boxes (paper, Equation 1) is not enough, and what is:
//
// A corner r of the bounds (scaled, relative to the entity's origin, |r| <= rho) is at c(t) = p(t) + R(t) r,
// where p is linear in t and R rotates with the constant w. So c'' = w x (w x R r), and along axis i
//     |c_i''| <= |w|^2 |r_perp . e_i| <= rho |w|^2 sqrt(1 - w_i^2 / |w|^2) = rho |w| sqrt(|w|^2 - w_i^2)
// since r_perp, the part of R r perpendicular to w, contributes only along the part of e_i that is
// perpendicular to w. A function deviates from its chord over [t0, t1] by at most (t1 - t0)^2 max|f''| / 8
// (linear interpolation), and the chord is between the corner's two end values, so in the union of the exact
// end boxes. Hence (a) contains the corner:
//     that union, enlarged along axis i by  rho |w| sqrt(|w|^2 - w_i^2) (t1 - t0)^2 / 8
// which is rho phi^2 / 8 perpendicular to the axis of rotation, phi = |w| (t1 - t0), and zero along it. No
// corner is ever farther than rho from the moving origin. Hence (b) contains it too:
//     the union of the two origins, enlarged by rho
// Every point of the bounds is a convex combination of corners, so (a) and (b) contain the whole body, and so
// does the tighter of the two for each side: (a) for small rotations, (b) for large ones. A pad of a few
// units in the last place of the largest quantity covers rounding errors.

#include <glm/ext/vector_double3.hpp>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// An axis-aligned box in the world frame, metres.
struct WorldBox {
  glm::dvec3 minimum_m{0.0};
  glm::dvec3 maximum_m{0.0};
};

/// The oriented bounds of an entity at one instant, world frame: the geometry's box, scaled and posed.
struct OrientedBox {
  glm::dvec3 center_m{0.0};
  glm::dvec3 axis[3]{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};  ///< orthonormal
  glm::dvec3 half_extent_m{0.0};
};

OrientedBox oriented_box(const Bounds& bounds, const glm::dvec3& scale, const Pose& pose) noexcept;

/// The smallest axis-aligned box around an oriented one.
WorldBox box_around(const OrientedBox& box) noexcept;

/// rho: the largest distance of a scaled corner of the bounds from the entity's origin, its centre of
/// rotation.
double reach_m(const Bounds& bounds, const glm::dvec3& scale) noexcept;

/// A box that contains the entity's oriented bounds at every t in [t0, t1]. Misuse: t0 > t1. For t0 == t1 it
/// is the exact box plus the pad.
WorldBox motion_bounds(const Bounds& bounds, const glm::dvec3& scale, const Motion& motion, WorldTime t0,
                       WorldTime t1) noexcept;

}  // namespace rtstdb
