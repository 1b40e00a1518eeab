#pragma once
// Contacts of two bodies of which at least one does not consist of convex parts: the truth, and the judgement
// of an answer. Internal to the oracle and for tests.
//
// The bodies are in contact if their surfaces cross or a point of one surface is inside the other body. A
// geometry has an inside if it is closed. The depth of a point of one surface in the other body is its
// distance from that body's surface.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>

#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_ray.hpp"
#include "rtstdb/oracle/surface_body.hpp"
#include "rtstdb/oracle/surface_pair.hpp"

namespace rtstdb::oracle {

/// Whether one of the entities does not consist of convex parts. Misuse: an entity without geometry.
bool is_surface_pair(const World& world, EntityId first, EntityId second);

/// Two entities at an instant, with their surfaces relative to the origin of the first one.
struct SurfacePair {
  PosedEntity first, second;
  SurfaceBody first_surface, second_surface;

  SurfacePair(const World& world, EntityId first_id, EntityId second_id, WorldTime t);
};

/// As PairTruth::precision_m.
double surface_precision_m(const SurfaceBody& first, const SurfaceBody& second, double distance_m);
/// Whether one of the connected pieces of a surface lies in the body. The two surfaces do not cross.
bool has_component_in(const SurfaceBody& surface, const SurfaceBody& body);

/// How much less than the truth the answered depth of a pair may be, relative to the diagonal of the smaller
/// body, in addition to depth_relative_tolerance of the depth.
inline constexpr double surface_depth_tolerance = 1.0 / 500.0;

struct SurfaceTruth {
  bool is_contact = false;
  bool has_depth = false;   ///< at least one body has an inside
  double distance_m = 0.0;  ///< between the surfaces; 0: they cross or touch
  /// From the first entity's origin, world axes. Bodies apart: the ends of the shortest segment. In contact
  /// without depth: both are one point of the crossing. With depth: the deepest point and the point of the
  /// other surface that is nearest to it, each on its own surface.
  glm::dvec3 p_first_m{0.0}, p_second_m{0.0};
  std::uint32_t first_triangle = 0, second_triangle = 0;
  double min_depth_m = 0.0, max_depth_m = 0.0;  ///< bounds of the greatest depth
  /// The surfaces cross, and no translation of the first body that is shorter undoes all crossings.
  double crossing_margin_m = 0.0;
  double precision_m = 0.0;         ///< as of a PairTruth
  double smaller_diagonal_m = 0.0;  ///< of the scaled bounds

  /// How much less than the truth an answered depth may be.
  double depth_tolerance_m() const noexcept;
  /// Whether the bodies are in contact by more than the precision and the tolerated error of a depth.
  bool is_certain_contact() const noexcept;
};

SurfaceTruth surface_truth(const SurfacePair& pair);
SurfaceTruth surface_truth(const World& world, EntityId first, EntityId second, WorldTime t);

/// 1 degree: the error that the normal of a separate pair of surfaces may have.
inline constexpr double contact_surface_angle_rad = 0.017453292519943295;

/// Judges one listed pair of surfaces. The answer is right if all of this holds:
///     status    right. Too close: the distance is within precision_m of the border to another status, or the
///               bodies are no certain contact.
///     distance  Of bodies that are apart, within precision_m. Of a contact, minus a depth that is at most
///               depth_tolerance_m below min_depth_m and at most precision_m above max_depth_m; 0 without
///               depth. Too close: a smaller depth that is not negative, since a search may end at a local
///               maximum. Its bounds contain it and are within these tolerances of it.
///     normal    of unit length; that of the first point. Of a separate pair, a translation of the first body
///               by the distance against it makes the bodies touch, within precision_m and
///               contact_surface_angle_rad of the distance.
///     points    1 to 4, none if the pair is separate. Half its depth before and behind each point, along
///               its normal, are the two named triangles, within precision_m. One of these two places is a
///               point of one surface to which the other surface is not nearer than the depth, by more than
///               precision_m, and which is inside the other body for a positive depth, outside for a negative
///               one. No point is deeper than the first one, whose depth is minus the distance, and none is
///               apart by more than the margin. Velocities are those of the rows.
///     has_depth right. Without depth, depths are 0, and points are within precision_m of both named
///               triangles.
Judgement judge_surface_pair(const SurfacePair& pair, const SurfaceTruth& truth, const ContactSearch& search,
                             const ContactPair& answer);

}  // namespace rtstdb::oracle
