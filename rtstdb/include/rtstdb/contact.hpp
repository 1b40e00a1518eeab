#pragma once
// Contacts of bodies (paper, Section 4 "Intersection Query", Section 4.3 and Table 2): which pairs of
// entities touch, where, in which direction and how deep.
//
//   convex    A pair of which both bodies are convex or consist of convex parts
//             (GeometryInfo::convex_parts): the hulls of the parts touch.
//   surfaces  Every other pair: the triangles of both bodies touch. A body has an inside if its geometry is
//             closed. Two bodies penetrate where their surfaces cross, or where one lies within the other.
//   distance  Between two bodies that do not touch: the length of the shortest segment between them. Of two
//             that penetrate: minus the depth.
//   depth     Convex: the length of the shortest translation that separates the deepest two parts. Surfaces:
//             that of the deepest point that was found, which is its distance from the surface of the body
//             in which it lies. A deeper point may exist: by as much as the error of the body's distance
//             field (field.hpp), and by more where the search ends at a local maximum of the depth.
//   frame     World axes. Points are relative to the origin of the pair's first entity at the search's time,
//             so that they are as precise far from the world's origin as near it.
//   time      Each search has its own (query.hpp).
//   order     Pairs by ascending index of the first entity, then of the second. An answer depends neither on
//             earlier ones nor on the order of the batch; what is tested when a batch exceeds its capacity
//             does (ContactAnswer::overflow).
//   threads   as all queries (query.hpp)
// Source: Gilbert, Johnson, Keerthi, "A fast procedure for computing the distance between complex objects in
// three-dimensional space", 1988; van den Bergen, "Proximity queries and penetration depth computation on 3D
// game objects", 2001; Macklin et al., "Local optimization for robust signed distance field collision", 2020.

#include <glm/ext/vector_float3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include <rtstdb/prepared_query.hpp>

namespace rtstdb {

class ContactQuery;

/// The pairs of one search at one instant:
///     first and second valid    this pair, which is listed whatever its distance
///     first alone               this entity with every other one that second_mask admits
///     neither                   every pair of one entity that first_mask admits with one that second_mask
///                               admits
/// No pair has an entity twice, and entities without geometry are in no pair; a named entity must have one
/// (no_geometry).
struct ContactSearch {
  EntityId first{};
  EntityId second{};
  std::uint32_t first_mask = mask_all;
  std::uint32_t second_mask = mask_all;
  WorldTime t{};
  /// Pairs that are apart by at most this distance are listed too, with contacts of negative depth.
  /// 0 to max_contact_margin_m.
  float margin_m = 0.0f;
};

enum class PairStatus : std::uint8_t {
  separate,  ///< apart by more than the margin; of a named pair
  near,      ///< apart by at most the margin
  contact,   ///< the bodies touch or penetrate
  /// The bounds of the distance are wider than the precision, and 0 or the margin lies between them; or the
  /// pair of surfaces did not fit into the batch: its bounds are then minus and plus the largest float.
  undecided,
};

/// A point at which two bodies touch or nearly touch.
struct ContactPoint {
  glm::vec3 p_first_m{0.0f};  ///< from the first entity's origin, world axes; midway between the surfaces
  glm::vec3 n_world{0.0f};    ///< unit, from the second body to the first
  /// How far the bodies overlap along the normal; negative: minus their distance. Of a pair of surfaces: the
  /// exact depth of a point of one surface in the other body.
  float depth_m = 0.0f;
  std::uint32_t first_triangle = 0;   ///< of the first entity's geometry, at the point
  std::uint32_t second_triangle = 0;  ///< of the second entity's
  /// World frame: velocity of the first body at the point, minus that of the second.
  glm::vec3 v_relative_mps{0.0f};
};

/// Contacts of one pair. The first entity is the one that the search names, or the one with the lower index.
struct ContactPair {
  EntityId first{}, second{};
  PairStatus status = PairStatus::separate;
  /// False for surfaces of which neither body has an inside: where they cross, depths are 0.
  bool has_depth = true;
  float distance_m = 0.0f;  ///< see above; between its bounds
  /// Bounds that contain the distance of the exact bodies (ContactQuery). For a decided pair of surfaces both
  /// are distance_m.
  float min_distance_m = 0.0f, max_distance_m = 0.0f;
  /// Unit, from the second body to the first: the normal of the first point, or the direction of the
  /// distance. For two convex bodies, or their two nearest parts, the gap along it is min_distance_m up to
  /// 4 ulp: a translation of the first by -min_distance_m along it separates bodies that penetrate. Zero if
  /// the pair is undecided.
  glm::vec3 n_world{0.0f};
  std::uint32_t point_count = 0;  ///< 0: the pair is separate or undecided, or the answer incomplete
  /// The point at which the bodies are deepest in one another, or nearest, comes first; then the points that
  /// span the most area of the surface in which they touch.
  std::array<ContactPoint, 4> points{};

  std::span<const ContactPoint> contacts() const noexcept { return {points.data(), point_count}; }
};

/// Answer to one search. Listed are: a named pair; of other pairs those that touch, those within the margin,
/// and those that are undecided and may be within it.
struct ContactAnswer {
  std::span<const ContactPair> pairs{};
  std::uint32_t found = 0;  ///< pairs that would be listed without limits, of those that were tested
  /// Named pairs, and other pairs whose oriented bounds overlap; the bounds of the first entity are wider by
  /// the margin on each side.
  std::uint32_t candidates = 0;
  /// The search reached a limit of the options: `found` is above pairs_per_search (the list then holds the
  /// first ones), or the batch has more candidates than max_candidates or more bodies than max_bodies (those
  /// of the first searches and entities were tested), or more surfaces than fit (pairs that do not fit are
  /// undecided).
  bool overflow = false;
  /// A search for the answer reached the device's limits: pairs may be missing, a named one too; a listed
  /// pair of surfaces may lack points, and its distance_m may then be 0.
  bool incomplete = false;
};

struct ContactQueryOptions {
  using Prepared = ContactQuery;
  std::string name{};                   ///< for reports and error texts
  std::uint32_t capacity = 0;           ///< searches in a batch: 1 to max_contact_searches
  std::uint32_t pairs_per_search = 64;  ///< that an answer lists: 1 to max_contact_pairs
  /// Pairs of all searches of a batch whose bounds may overlap, named pairs included, and at most as many
  /// pairs of convex parts: 1 to max_contact_candidates. 0: capacity times pairs_per_search.
  std::uint32_t max_candidates = 0;
  /// Entities whose neighbours are searched in a batch: one for each search that names its first entity
  /// alone, and for one that names none all entities that either mask admits. 1 to max_entities.
  std::uint32_t max_bodies = 16384;
  /// Pairs of surfaces of a batch: up to max_candidates. 0: max_candidates, but at most
  /// default_contact_surface_pairs.
  std::uint32_t max_surface_pairs = 0;
  /// Near triangles of these pairs: of the first body those within the margin of the second body's box (of a
  /// named pair, within an upper bound of its distance), of the second body those that overlap the first
  /// body's box. The surfaces of all pairs of the batch together may have 32 times as many triangles. About
  /// 180 bytes each. 1 to max_contact_surface_triangles.
  std::uint32_t max_surface_triangles = 1u << 16;
  LatePolicy late = LatePolicy::discard;
};

/// Contacts between bodies. `searches` has `capacity` elements; `answers` has one for each search of the last
/// transaction.
/// Precision of convex bodies. The ulp of a body is the unit in the last place of single precision at its
/// largest scaled coordinate, or at the largest coordinate of its mesh times the scale, whichever is more:
///   bounds   always contain the distance of the hulls of the meshes' corners, or of the solids with sizes in
///            single precision, at the rows' poses. They are apart by at most contact_precision (limits.hpp)
///            times the diagonal of the smaller body, 8 ulp of the larger body or 8 units in the last place
///            of the distance, whichever is most; or, of bodies that penetrate, by 1 % of the depth.
///   status   That of distance_m where the bounds are within this precision: a body that rests on another one
///            is in contact with it or apart by less than the precision.
///   normals  Spheres and capsules of uniform scale, and cylinders of uniform scale that touch with a cap or
///            with the line of their side: within 1e-5 rad, or 4 ulp of the other body over the radius,
///            whichever is more. On flat faces of the other body: 1e-6 rad in place of 1e-5 rad. Rims of
///            cylinders on rims and edges, and ellipsoids: within 1e-3 rad.
///   points   At half its depth before and behind each point, along the normal, are the surfaces of both
///            bodies and the named triangles, within the precision. At no point are the surfaces
///            farther apart than the margin plus the precision.
/// Pairs that single precision does not decide, and every depth, are computed in double precision. Precision
/// of surfaces: 1e-4 of the diagonal of the smaller body, or 4 ulp of the larger body or of the distance,
/// whichever is most; for their depths see above.
class ContactQuery : public Query {
 public:
  virtual std::span<ContactSearch> searches() noexcept = 0;
  virtual std::span<const ContactAnswer> answers() const noexcept = 0;
};

const char* to_string(PairStatus status) noexcept;

}  // namespace rtstdb
