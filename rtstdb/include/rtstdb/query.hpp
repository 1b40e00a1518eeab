#pragma once
// Prepared queries (paper, Section 4.3 and Table 2). The caller prepares a query once, with its capacity. In
// the tick it fills the query's input span and adds the query to a transaction. When the transaction has
// completed, the output span holds the answers.
//
// Rules for all queries
//   frame      world, right-handed, metres, unless the query element names a carrier
//   time       Every element has its own WorldTime. No time may be before the version's time, and the times
//              of one batch (the elements of one query in one transaction) may span at most
//              max_query_window_ns; otherwise the transaction ends as bad_input (time_not_covered,
//              window_too_long). A query that ignores motion uses the version's time. If the times of all
//              queries of a transaction span more than that, the queries are executed in several groups, each
//              with its own acceleration structures, which costs more.
//   ties       lowest entity index first, then lowest triangle index
//   order      An answer depends neither on the order of the batch nor on its division into chunks, with one
//              exception: bounds enclose the motion over the times of the whole batch, so close to the
//              device's limits these times can decide whether a region or nearest search is incomplete, and
//              what its answer lists. Ray searches have no such limit.
//   capacity   exceeded capacities are flagged in the answer, never silent
//   threads    A query belongs to one transaction at a time. From submit to the outcome, the caller neither
//              writes its input span nor reads its answers.
//   lifetime   a query must not outlive its Database, whose destructor aborts then

#include <glm/ext/quaternion_float.hpp>
#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <variant>

#include <rtstdb/contact.hpp>
#include <rtstdb/entity.hpp>
#include <rtstdb/image.hpp>
#include <rtstdb/impact.hpp>
#include <rtstdb/prepared_query.hpp>

namespace rtstdb {

// ---- ray

class RayQuery;

enum class RayMode : std::uint8_t {
  closest,  ///< the hit with the smallest lambda
  any,      ///< whether anything is hit; only `status` is set
  first,    ///< the hits_per_ray hits with the smallest lambdas, in that order
};

/// A ray at one instant: the points origin_m + lambda * direction with lambda in [lambda_min, lambda_max],
/// where 0 <= lambda_min <= lambda_max. The direction need not have unit length; its largest component must
/// be between 1e-15 and 1e15. With a carrier, origin and direction are in the carrier's frame (unscaled) and
/// move with it: the ray starts at the carrier's pose at time `t`, and `v_relative_mps` subtracts the
/// velocity of the moving origin.
/// Precision: a range that begins or ends at the lambda of a hit includes that hit. Rays do not pass between
/// triangles that share an edge. Rounding decides whether a ray hits a triangle that it meets only at an edge
/// or a corner, or in whose plane it lies. No ray hits a triangle without area. Ties are of lambdas in single
/// precision.
/// Source: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", 2013.
struct alignas(16) Ray {
  glm::vec3 origin_m{0.0f};
  glm::vec3 direction{1.0f, 0.0f, 0.0f};
  float lambda_min = 0.0f;
  float lambda_max = 1e30f;
  WorldTime t{};
  std::uint32_t mask = mask_all;
  EntityId carrier{};  ///< default: none, the ray is in the world frame
};

/// Which sides of triangles a ray or a cone meets.
enum class Faces : std::uint8_t { both, front, back };

enum class HitStatus : std::uint32_t {
  miss = 0,
  hit = 1,
  incomplete = 2,  ///< the search did not complete: neither a hit nor a miss follows from it
};

struct RayHit {
  HitStatus status = HitStatus::miss;
  float lambda = 0.0f;
  float u = 0.0f, v = 0.0f;    ///< barycentric weights of the second and third corner
  EntityId entity{};           ///< invalid on a miss
  std::uint32_t mask = 0;      ///< the entity's
  MaterialId material{};       ///< the entity's
  std::uint32_t triangle = 0;  ///< index in the mesh of the entity's geometry
  bool front_face = false;     ///< the ray came from the triangle's front
  glm::vec3 n_world{0.0f};     ///< unit geometric normal, on the front side of the triangle
  /// World frame: velocity of the hit point, minus that of the ray's origin.
  glm::vec3 v_relative_mps{0.0f};
};

struct RayQueryOptions {
  using Prepared = RayQuery;
  std::string name{};          ///< for reports and error texts
  std::uint32_t capacity = 0;  ///< rays in a batch: 1 to max_rays_per_query
  RayMode mode = RayMode::closest;
  std::uint32_t hits_per_ray = 1;  ///< RayMode::first: 1 to max_hits_per_ray; else 1 (bad_input)
  Faces faces = Faces::both;
  /// True: every entity, carriers included, stays at its pose at the version's time, whatever the times of
  /// the rays (the paper's "temporal unaware" case, Section 6). v_relative_mps still follows from the
  /// velocities of the rows.
  bool ignore_motion = false;
  LatePolicy late = LatePolicy::discard;
};

/// Closest, any or first hits of rays (paper, Ray-Tracing Query; traversal as in Section 5.2).
/// Memory: rays and hits are in host memory that the device reads and writes directly, if it can; the spans
/// stay at their addresses for the lifetime of the query.
/// Incomplete hits: a search may take several dispatches, with preemption points between them. It is
/// incomplete only in these cases: LatePolicy::partial ended the transaction; a tree has more than 96 levels;
/// or a chain of searches preempted one another, each of higher priority, and later transactions used up the
/// slots that keep the world of a preempted search. There are slots for the shapes of deforming geometry of
/// one preempted search, and for the versions and times of three, or of one in a world of more than 131,072
/// entities, for the lowest priorities first.
/// Performance: on a device with subgroups of eight lanes (lavapipe with 256 bits), RayMode::closest and
/// RayMode::any are faster if each eight neighbours in the batch (elements 0 to 7 and so on) have the same
/// origin and carrier and directions within 0.04 rad, as in the rows of a camera.
class RayQuery : public Query {
 public:
  virtual std::span<Ray> rays() noexcept = 0;  ///< `capacity` elements, to be filled by the caller
  /// hits_per_ray hits for each ray of the last transaction. RayMode::first: every triangle counts that the
  /// ray crosses, so a ray through an edge has a hit on each of the two triangles, at the same lambda. Unused
  /// hits are misses; if the search was incomplete, all hits of the ray are marked incomplete.
  virtual std::span<const RayHit> hits() const noexcept = 0;
};

// ---- region

class RegionQuery;

/// Kind of the results of a region query. Entities without geometry are never found.
enum class RegionLevel : std::uint8_t {
  bounds,    ///< entities, by their oriented bounding boxes, which are solid
  surface,   ///< entities, by their triangles
  triangle,  ///< single triangles of all entities
};

/// Regions, boxes and triangles include their borders: touching from outside counts. Triangles without area
/// count as the segments or points that they are. A surface is not solid: a region deep inside a closed mesh
/// touches none of its triangles.
enum class RegionShape : std::uint32_t { box, sphere, frustum };
enum class RegionTest : std::uint32_t {
  touching,  ///< the box, surface or triangle has a point in common with the region
  inside,    ///< every corner of the box, surface or triangle is in the region
};

/// A region at one instant, with its centre at center_m and its orientation q, whose length must be between
/// 1e-6 and 1e6. With a carrier, both are in the carrier's frame (unscaled).
///     box      extents 2 * half_extent_m
///     sphere   radius half_extent_m.x
///     frustum  The field of view of a camera or a radar. center_m is the eye; the view direction is x, with
///              y to the left and z up. It begins near_m in front of the eye and ends half_extent_m.x in
///              front of it, where it extends half_extent_m.y and half_extent_m.z to each side: the far
///              distance times the tangent of half the opening angle.
/// No extent may be negative. A frustum needs 0 <= near_m <= half_extent_m.x, half_extent_m.x > 0, and side
/// extents of at most 1e15 times half_extent_m.x.
struct Region {
  RegionShape shape = RegionShape::box;
  RegionTest test = RegionTest::touching;
  glm::vec3 center_m{0.0f};
  glm::vec3 half_extent_m{0.0f};
  float near_m = 0.0f;  ///< frustum
  glm::quat q{1.0f, 0.0f, 0.0f, 0.0f};
  WorldTime t{};
  std::uint32_t mask = mask_all;
  EntityId carrier{};
};

/// A triangle of an entity: `triangle` is its index in the mesh of the entity's geometry.
struct EntityTriangle {
  EntityId entity{};
  std::uint32_t triangle = 0;
  friend bool operator==(const EntityTriangle&, const EntityTriangle&) = default;
};

/// Answer to one region: `entities` by ascending index, or, with RegionLevel::triangle, `triangles` by entity
/// index and then by triangle index. If more were found than ids_per_region, `found` is the true number,
/// `overflow` is set and the list holds the lowest ones. A query that only counts (ids_per_region = 0) never
/// overflows. Nothing found: empty list, found = 0.
///
/// Single precision decides at the border: whatever is closer to it than a few units in the last place of the
/// distances involved (from the world's origin, the sizes of region and entity, the distance moved since
/// valid_from) may be found or not.
struct RegionAnswer {
  std::span<const EntityId> entities{};
  std::span<const EntityTriangle> triangles{};
  std::uint32_t found = 0;  ///< entities, or triangles
  bool overflow = false;
  /// The search reached the device's limits: all listed are in the region, but more may be, with lower
  /// indices too.
  bool incomplete = false;
};

struct RegionQueryOptions {
  using Prepared = RegionQuery;
  std::string name{};          ///< for reports and error texts
  std::uint32_t capacity = 0;  ///< regions in a batch: 1 to max_regions_per_query
  RegionLevel level = RegionLevel::bounds;
  /// Largest number of entities or triangles that an answer lists, up to max_ids_per_region. 0: the query
  /// only counts, which is faster.
  std::uint32_t ids_per_region = 64;
  LatePolicy late = LatePolicy::discard;
};

/// Entities or triangles in a region (paper, Region Query). `regions` has `capacity` elements; `answers` has
/// one for each region of the last transaction.
class RegionQuery : public Query {
 public:
  virtual std::span<Region> regions() noexcept = 0;
  virtual std::span<const RegionAnswer> answers() const noexcept = 0;
};

// ---- nearest

class NearestQuery;

/// Feature of an entity to which its distance is measured.
enum class NearestTarget : std::uint8_t {
  center,    ///< the centre of its oriented bounding box, which need not be near its origin
  bounds,    ///< its oriented bounding box, which is solid: the distance inside is zero
  surface,   ///< its nearest triangle: at most one neighbor for each entity
  triangle,  ///< each triangle separately: an entity may be found several times
};

/// A point at one instant whose nearest entities or triangles are searched, up to the distance radius_m. With
/// a carrier, the point is in the carrier's frame (unscaled) and moves with it: it is at the carrier's pose
/// at time `t`, and `v_relative_mps` subtracts its velocity. Entities without geometry are never found.
/// Triangles without area count as the segments or points that they are.
struct Nearest {
  glm::vec3 point_m{0.0f};
  float radius_m = std::numeric_limits<float>::infinity();  ///< not negative; inclusive
  WorldTime t{};
  std::uint32_t mask = mask_all;
  EntityId carrier{};  ///< default: none, the point is in the world frame
  /// An entity that is not found, usually the carrier; default: none. It must exist, or the transaction is
  /// refused.
  EntityId excluded{};
};

/// One result of a nearest query, aligned to eight bytes as the device writes it.
struct alignas(8) Neighbor {
  EntityId entity{};
  std::uint32_t mask = 0;      ///< the entity's
  MaterialId material{};       ///< the entity's
  std::uint32_t triangle = 0;  ///< surface, triangle
  /// Negative if the query is signed, `has_sign` is set and the point is inside the entity.
  float distance_m = 0.0f;
  float u = 0.0f, v = 0.0f;        ///< surface, triangle: barycentric weights of the second and third corner
  bool has_sign = false;           ///< the query is signed and the entity's geometry is closed
  glm::vec3 p_world_m{0.0f};       ///< the nearest point of the target
  glm::vec3 v_relative_mps{0.0f};  ///< world frame: velocity of that point, minus that of the query's point
};

/// Answer to one point: at most k neighbors, by ascending |distance_m|; at equal distance the lowest entity
/// index first, then the lowest triangle index. Fewer, or none, if the radius contains fewer.
struct NearestAnswer {
  std::span<const Neighbor> neighbors{};
  /// The search reached the device's limits: nothing follows from it, and `neighbors` is empty.
  bool incomplete = false;
};

/// Signed distances: a geometry is closed if, along every edge, as many triangles run in one direction as in
/// the other, where edges are compared by the positions of their ends. Solids are closed, also hollow ones
/// and several that touch or overlap, whether or not they share corners by index. A point is inside if the
/// surface winds around it (winding number not zero), whichever side its fronts are on. Distances to an open
/// geometry have no sign.
struct NearestQueryOptions {
  using Prepared = NearestQuery;
  std::string name{};          ///< for reports and error texts
  std::uint32_t capacity = 0;  ///< points in a batch: 1 to max_points_per_query
  NearestTarget target = NearestTarget::surface;
  std::uint32_t k = 1;     ///< neighbors of a point: 1 to max_neighbors
  bool is_signed = false;  ///< only for surface and triangle; refused for the other targets
  LatePolicy late = LatePolicy::discard;
};

/// The k nearest entities or triangles (paper, Nearest Neighbor Query). `points` has `capacity` elements;
/// `answers` has one for each point of the last transaction.
class NearestQuery : public Query {
 public:
  virtual std::span<Nearest> points() noexcept = 0;
  virtual std::span<const NearestAnswer> answers() const noexcept = 0;
};

// ---- cone

class ConeQuery;

/// How the first contact with an entity is found.
enum class ConeMode : std::uint8_t {
  exact,  ///< by a search of the entity's triangles
  /// Sphere tracing in the distance field of the entity's geometry (GeometryOptions::field,
  /// Database::build_field) skips free space; where the field shows that a surface may be near, the triangles
  /// there are searched. Geometry without a field, and cones wider than a right angle, are searched as in the
  /// exact mode, with the same bits.
  /// Errors: where the field overestimates the distance by e, a part of the surface may be skipped. Then
  /// lambda is too large by at most e / (sin theta + tan(a / 2)) plus the radius of the beam there, where
  /// theta is the angle between axis and surface and a the opening angle, or a cone that grazes the entity
  /// misses it. e is 0 at most points, since the search uses a lower bound of the field, and a few hundredths
  /// of a cell at the others. Where e is 0, the answer is that of the exact mode.
  fast,
};

/// A beam at one instant: the points whose distance from the axis is at most z tan(opening_angle_rad / 2),
/// where z, their coordinate along the axis, counts from the apex `origin_m` and is between 0 and lambda_max
/// times the length of `direction`. `direction` and `carrier` are those of a Ray; lambda counts along the
/// axis. The opening angle is the full one, from side to side: 0 <= opening_angle_rad < pi. With 0 the cone
/// is a ray, and its return has the bits of the closest hit of a RayQuery.
struct Cone {
  glm::vec3 origin_m{0.0f};
  glm::vec3 direction{1.0f, 0.0f, 0.0f};
  float opening_angle_rad = 0.0f;
  float lambda_max = 1e30f;  ///< not negative
  WorldTime t{};
  std::uint32_t mask = mask_all;
  EntityId carrier{};  ///< default: none, the cone is in the world frame
};

/// The first contact of a cone with one entity: of the points of the entity's triangles in the cone, one with
/// the least lambda. A cone meets every triangle that a ray along its axis hits, and none without area.
/// Aligned to eight bytes, as the device writes it.
struct alignas(8) ConeReturn {
  HitStatus status = HitStatus::miss;
  float lambda = 0.0f;
  float u = 0.0f, v = 0.0f;    ///< of the contact: barycentric weights of the second and third corner
  EntityId entity{};           ///< invalid on a miss
  std::uint32_t mask = 0;      ///< the entity's
  MaterialId material{};       ///< the entity's
  std::uint32_t triangle = 0;  ///< index in the mesh of the entity's geometry
  bool front_face = false;     ///< the apex is in front of the triangle
  /// ConeQueryOptions::fractions: more than max_entities_per_beam entities are in the cone, and a part of the
  /// beam passes the nearest ones: it may reach entities that are not listed. Set in all returns of the cone.
  bool overflow = false;
  bool by_field = false;    ///< found with the distance field of the entity's geometry
  glm::vec3 n_world{0.0f};  ///< unit geometric normal, on the front side of the triangle
  /// World frame: velocity of the contact point, minus that of the apex.
  glm::vec3 v_relative_mps{0.0f};
  /// ConeQueryOptions::fractions: the part of the beam's cross-section that reaches the entity past all
  /// nearer ones; without that option 0. The fractions of a cone sum to at most 1.
  float fraction = 0.0f;
};

struct ConeQueryOptions {
  using Prepared = ConeQuery;
  std::string name{};                  ///< for reports and error texts
  std::uint32_t capacity = 0;          ///< cones in a batch: 1 to max_cones_per_query
  std::uint32_t returns_per_cone = 1;  ///< 1 to max_returns_per_cone
  Faces faces = Faces::both;           ///< front: triangles whose front faces the apex
  ConeMode mode = ConeMode::exact;
  /// True: of the max_entities_per_beam entities with the least lambda, those that a part of the beam reaches
  /// are returns, each with its fraction. False: all entities in the cone are returns, hidden ones too.
  bool fractions = false;
  LatePolicy late = LatePolicy::discard;
};

/// The first entities in cones (paper, Cone-Tracing Query), by their triangles or by distance fields.
/// Fractions: a surface covers the part of the cross-section onto which the central projection from the apex
/// maps it. Triangles with a side that `faces` excludes are transparent. The area that one entity covers is
/// exact; 64 fixed directions estimate the visible part of it, to a few hundredths of the beam. An entity
/// that none of these directions meets has the fraction of its whole area if its contact is visible from the
/// apex, else 0. So an entity may be missing from the returns if less than about 1/64 of the beam reaches it.
/// In a beam narrower than 2e-6 rad the first entity has the fraction 1, as with a ray.
/// Fractions in ConeMode::fast: along each of the 64 directions only the nearest surface is searched. The
/// fraction of an entity that at least 8 directions meet is the share of these directions, right to a few
/// hundredths. The same holds for an entity that fewer directions meet and that has more than about 500
/// triangles in the beam. Other entities have the fraction of the exact mode. The cost depends little on the
/// number of triangles in the beam, but for those of entities that no direction meets.
/// Areas are computed in single precision: the fraction of a triangle is off by about 1e-7 times its size
/// over the beam's radius where it meets it.
/// Incomplete returns: a search that visits more than about 15,000 nodes of the trees may be incomplete, and,
/// with fractions, one with more than about 100,000 triangles in the cone.
class ConeQuery : public Query {
 public:
  virtual std::span<Cone> cones() noexcept = 0;  ///< `capacity` elements, to be filled by the caller
  /// returns_per_cone elements for each cone of the last transaction, by ascending lambda, then by entity
  /// index. Unused elements are misses; if the search of a cone was incomplete, all of its elements are
  /// incomplete.
  virtual std::span<const ConeReturn> returns() const noexcept = 0;
};

// ---- overlap

class OverlapQuery;

/// The entities whose oriented bounding boxes overlap or touch the box of a given entity at time t: the broad
/// phase of the paper's Intersection Query. The entity itself is not in its answer. It must have a geometry
/// (no_geometry).
struct Overlap {
  EntityId entity{};
  WorldTime t{};
  std::uint32_t mask = mask_all;  ///< which other entities are considered
};

/// `entities`, `found`, `overflow` and `incomplete` as in a region's answer; `triangles` is empty.
using OverlapAnswer = RegionAnswer;

struct OverlapQueryOptions {
  using Prepared = OverlapQuery;
  std::string name{};          ///< for reports and error texts
  std::uint32_t capacity = 0;  ///< entities in a batch: 1 to max_regions_per_query
  /// Largest number of entities that an answer lists. 0: the query only counts, which is faster.
  std::uint32_t ids_per_entity = 64;
  LatePolicy late = LatePolicy::discard;
};

/// `overlaps` has `capacity` elements; `answers` has one for each element of the last transaction.
class OverlapQuery : public Query {
 public:
  virtual std::span<Overlap> overlaps() noexcept = 0;
  virtual std::span<const OverlapAnswer> answers() const noexcept = 0;
};

// ---- every kind

namespace detail {
template <class First, class... Rest>
struct VariantOfRest {
  using type = std::variant<Rest...>;
};
}  // namespace detail

/// Refers to the options of a query of any kind (rtstdb/query_kinds.def).
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) , const Class##Options*
using QueryOptionsRef = detail::VariantOfRest<void
#include <rtstdb/query_kinds.def>
                                              >::type;
#undef QUERY_KIND

const char* to_string(RayMode mode) noexcept;
const char* to_string(Faces faces) noexcept;
const char* to_string(ConeMode mode) noexcept;
const char* to_string(HitStatus status) noexcept;
const char* to_string(RegionLevel level) noexcept;
const char* to_string(RegionShape shape) noexcept;
const char* to_string(RegionTest test) noexcept;
const char* to_string(NearestTarget target) noexcept;

}  // namespace rtstdb
