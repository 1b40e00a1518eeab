#pragma once
// Prepared queries (paper, Section 4 and Table 2). A caller prepares a query once, with its capacity; in the
// tick it fills the query's input span and adds the query to a transaction; after the transaction the answers
// stand in the output span.
//
// Common rules
//   frame      world, right-handed, metres, unless the query is carried by an entity
//   time       every element has its own WorldTime. None may be before the version's own time, and those of
//              one batch (the elements of one query in one transaction) span at most max_query_window_ns;
//              else the transaction is refused (BadInput: time_not_covered, window_too_long). A query that
//              ignores motion uses the version's time. Where the times of all queries of a transaction span
//              more, the queries are executed in several groups, each with its own structures, which costs
//              more
//   ties       lowest entity index first, then lowest triangle index
//   order      answers do not depend on the order of the batch nor on how it was split. Boxes fit the span of a batch's times:
//              of regions and nearest, close to the device's limits, that may decide whether a search is cut short, and what an
//              incomplete answer lists. Rays have no such limit
//   threads    a query belongs to one transaction at a time; between submit and completion the caller
//              leaves it alone
//   lifetime   a query must not outlive its Database

#include <glm/ext/quaternion_float.hpp>
#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <variant>

#include <rtstdb/entity.hpp>

namespace rtstdb {

/// What a query's spans hold when its transaction was not done in time. A transaction may ask queries with different ones.
enum class LatePolicy : std::uint8_t {
  /// Answers of transactions that were done, late or not; else none.
  discard,
  /// Those, and when a transaction comes to nothing, for whatever reason, the answers of the last one that was done stay:
  /// Outcome::stale, and answer_info() says how old they are. Takes twice the memory for answers.
  last_good,
  /// In a transaction without writes: what could be answered by the deadline. When all that is left to be answered are
  /// queries of this kind, the transaction ends when it would else pass its deadline, whatever its class: it is done, and
  /// truncated (Outcome::partial). A firm one that passes it nevertheless, or still has others to answer, is missed, and
  /// the elements that were answered by then stand, with those of long searches that were answered while it passed. Queries
  /// are answered in the order in which they were asked. Elements without an answer are marked as incomplete. Batches are
  /// divided as usual (DatabaseOptions::chunk), and this is looked at between chunks: of a batch that is not divided, all is
  /// answered or nothing. Never under a virtual clock. In a transaction with writes as discard: there is no version that
  /// they could be answers to.
  partial,
};

/// Whose answers a query's spans hold.
struct AnswerInfo {
  std::uint32_t elements = 0;  ///< that the spans are about; 0: none
  std::uint32_t missing = 0;   ///< of them, those marked as incomplete, for whatever reason
  Version version = 0;         ///< the version that was asked
  WorldTime version_time{};
  ClockTime published{};  ///< when they could first be read; zero where the transaction was missed
  bool stale =
      false;  ///< LatePolicy::last_good: the last transaction came to nothing, they are of one before
  Nanoseconds age{0};  ///< stale: from `published` until that transaction ended
};

/// What all prepared queries can tell.
class Query {
 public:
  virtual ~Query() = default;
  /// After the outcome of a transaction that asked the query, until it is submitted again.
  virtual const AnswerInfo& answer_info() const noexcept = 0;
};

// ---- ray

class RayQuery;

enum class RayMode : std::uint8_t {
  closest,  ///< the hit with the smallest lambda
  any,      ///< whether anything is hit: `status` alone is filled
  first,    ///< the hits_per_ray hits with the smallest lambdas, in that order
};

/// Points on the ray: origin + lambda * direction, lambda in [lambda_min, lambda_max], where 0 <= lambda_min <=
/// lambda_max. The direction need not be unit; its largest component is between 1e-15 and 1e15. With a carrier, origin and direction are given in the carrier's frame (unscaled) and move with
/// it: the ray starts where the carrier is at `t`, and its origin's velocity takes part in `v_relative`.
/// A triangle that a ray meets at an edge or a corner alone, or in whose plane it runs, is hit or not as rounding has it; between triangles
/// that share an edge none slips through. One without area is hit by nobody. Ties are those of lambdas as single precision has them; a
/// range that begins or ends at the lambda of a hit holds that hit.
struct alignas(16) Ray {
  glm::vec3 origin_m{0.0f};
  glm::vec3 direction{1.0f, 0.0f, 0.0f};
  float lambda_min = 0.0f;
  float lambda_max = 1e30f;
  WorldTime t{};
  std::uint32_t mask = mask_all;
  EntityId carrier{};  ///< default: none, the ray is in the world frame
};

/// Which sides of triangles are hit.
enum class Faces : std::uint8_t { both, front, back };

enum class HitStatus : std::uint32_t {
  miss = 0,
  hit = 1,
  incomplete = 2,  ///< the search was cut short: no answer may be drawn from it
};

struct RayHit {
  HitStatus status = HitStatus::miss;
  float lambda = 0.0f;
  float u = 0.0f, v = 0.0f;    ///< barycentric weights of the second and third corner
  EntityId entity{};           ///< invalid on a miss
  std::uint32_t mask = 0;      ///< the entity's
  std::uint32_t material = 0;  ///< the entity's
  std::uint32_t triangle = 0;
  bool front_face = false;  ///< the ray came from the triangle's front
  glm::vec3 n_world{0.0f};  ///< unit geometric normal, on the side of the triangle's front
  glm::vec3 v_relative_mps{
      0.0f};  ///< world frame: velocity of the hit point minus velocity of the ray's origin
};

struct RayQueryOptions {
  using Prepared = RayQuery;
  std::string name{};  ///< shown in reports
  std::uint32_t capacity = 0;
  RayMode mode = RayMode::closest;
  std::uint32_t hits_per_ray = 1;  ///< RayMode::first: 1 to max_hits_per_ray; else 1
  Faces faces = Faces::both;
  /// True: every entity stands still at its pose of the version's time, whatever the rays' times (the paper's
  /// "temporal unaware" case). Carriers too. v_relative_mps is still made of the rows' velocities, at those
  /// poses.
  bool ignore_motion = false;
  LatePolicy late = LatePolicy::discard;
};

/// Rays and hits lie in memory of the host that the device reads and writes where it can: nothing is copied on the
/// way. They stay where they are as long as the query lives.
/// A search takes as long as it takes, in several dispatches if need be, and between them others run and deadlines are looked
/// at. It is cut short (HitStatus::incomplete) by LatePolicy::partial; in a tree of more than 96 levels, which nobody has
/// seen; and where such searches stand in the midst of one another, each more urgent than the one before, and others yet ask
/// again and again for something else. Kept for them are, from the least urgent one on, the shapes of geometry that
/// deforms of one, and versions and times of three, or of one in a world of more than 131,072 entities.
/// Order: no answer depends on it. On a device whose subgroups have eight lanes, as lavapipe's have with 256 bits, nearest
/// hits and RayMode::any take less time where eight neighbours in the batch, the first eight and so on, have one origin and
/// carrier and run within 0.04 rad, as in the rows of a camera.
class RayQuery : public Query {
 public:
  virtual std::span<Ray> rays() noexcept = 0;  ///< capacity elements, the caller's to fill
  /// Of as many rays as the last transaction asked for, hits_per_ray for each. RayMode::first: every triangle
  /// that is crossed counts, so a ray through an edge has a hit on either side of it, at the same lambda; what
  /// is left over is misses, and all of them are incomplete where the search was cut short.
  virtual std::span<const RayHit> hits() const noexcept = 0;
};

// ---- region

class RegionQuery;

/// What a region finds. Entities without geometry are never found.
enum class RegionLevel : std::uint8_t {
  bounds,    ///< entities, by their oriented bounds, which are solid
  surface,   ///< entities, by their triangles
  triangle,  ///< triangles: each that is found, of whichever entity
};

/// Regions hold their borders, and bounds and triangles theirs: touching from outside counts. Triangles without
/// area count as the lines or points that they are. A surface is no body: a region deep inside a closed mesh
/// touches none of its triangles.
enum class RegionShape : std::uint32_t { box, sphere, frustum };
enum class RegionTest : std::uint32_t {
  touching,  ///< bounds, surface, triangle: they and the region have a point in common
  inside,    ///< bounds, surface, triangle: every corner lies in the region
};

/// A region at one instant, placed at center_m and turned by q, of a length above 1e-6 and below 1e6; with a carrier
/// both are in the carrier's frame (unscaled).
///     box      extents 2 * half_extent_m
///     sphere   of radius half_extent_m.x
///     frustum  what a camera or a radar sees: center_m is its eye; it looks along x, with y to the left and z
///              up, as sensors do. It begins near_m before the eye and ends half_extent_m.x before it, where it
///              is half_extent_m.y wide and half_extent_m.z high to each side: these are the far distance
///              times the tangents of half the angles of view.
/// No extent is negative; of a frustum 0 <= near_m <= half_extent_m.x, which is above zero, and the others are at most
/// 1e15 times as much.
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

/// A triangle of an entity: its place in the triangles of the entity's mesh.
struct EntityTriangle {
  EntityId entity{};
  std::uint32_t triangle = 0;
  friend bool operator==(const EntityTriangle&, const EntityTriangle&) = default;
};

/// Answer to one region. Entities by ascending index; at RegionLevel::triangle `triangles` instead, by entity
/// and then by triangle. When more than the capacity were found, `found` is the true count, `overflow` is set
/// and the list holds the lowest that fit. A query that only counts lists nothing and never overflows.
///
/// Single precision decides at the border: what lies nearer to it than some units in the last place of the
/// distances at play (from the world's origin, of the region's and the entity's size, of the way that they
/// have moved) may be found or not.
struct RegionAnswer {
  std::span<const EntityId> entities{};
  std::span<const EntityTriangle> triangles{};
  std::uint32_t found = 0;  ///< entities, or triangles
  bool overflow = false;
  /// Cut short by the device's limits: all that is listed was found, but more may have been, or lower ones.
  bool incomplete = false;
};

struct RegionQueryOptions {
  using Prepared = RegionQuery;
  std::string name{};
  std::uint32_t capacity = 0;  ///< regions in a batch
  RegionLevel level = RegionLevel::bounds;
  /// Entities, or triangles, that an answer lists at most. 0: the query only counts, which is faster.
  std::uint32_t ids_per_region = 64;
  LatePolicy late = LatePolicy::discard;
};

class RegionQuery : public Query {
 public:
  virtual std::span<Region> regions() noexcept = 0;
  virtual std::span<const RegionAnswer> answers() const noexcept = 0;
};

// ---- nearest

class NearestQuery;

/// What the distance is measured to.
enum class NearestTarget : std::uint8_t {
  center,    ///< the centre of the entity's oriented bounds; its origin may lie far outside of it
  bounds,    ///< the entity's oriented bounds, which are solid: zero inside
  surface,   ///< the entity's nearest triangle: one answer an entity
  triangle,  ///< every triangle by itself: an entity may answer several times
};

/// What is nearest to a point at one instant (paper, Section 4 and Table 2), not farther than radius_m. With a carrier, the point is given
/// in the carrier's frame (unscaled) and moves with it: it is where the carrier is at `t`, and its velocity
/// takes part in `v_relative_mps`. Entities without geometry are never found. Triangles without area count as
/// the lines or points that they are.
struct Nearest {
  glm::vec3 point_m{0.0f};
  float radius_m = std::numeric_limits<float>::infinity();  ///< not negative; what lies on it is found
  WorldTime t{};
  std::uint32_t mask = mask_all;
  EntityId carrier{};  ///< default: none, the point is in the world frame
  /// Never found: most often the carrier itself; default: none. Alive, or the batch is refused.
  EntityId excluded{};
};

/// By eight bytes, as the device writes it.
struct alignas(8) Neighbor {
  EntityId entity{};
  std::uint32_t mask = 0;      ///< the entity's
  std::uint32_t material = 0;  ///< the entity's
  std::uint32_t triangle = 0;  ///< surface, triangle
  /// Metres. Negative where the query is signed, `has_sign` is set and the point lies inside the entity.
  float distance_m = 0.0f;
  float u = 0.0f, v = 0.0f;        ///< surface, triangle: barycentric weights of the second and third corner
  bool has_sign = false;           ///< the query is signed and the entity's geometry is closed
  glm::vec3 p_world_m{0.0f};       ///< the point of the target that is nearest
  glm::vec3 v_relative_mps{0.0f};  ///< world frame: velocity of that point minus velocity of the query's
};

/// Answer to one point: the nearest first, whatever its sign, thus by |distance_m|; at the same distance the
/// lowest entity index, then the lowest triangle index. At most `k`, fewer where the radius holds no more;
/// empty when it holds nothing.
struct NearestAnswer {
  std::span<const Neighbor> neighbors{};
  /// Cut short by the device's limits: no answer may be drawn from it, and `neighbors` is empty.
  bool incomplete = false;
};

/// The sign. A geometry is closed when its triangles, by the places of their corners, run along every edge as
/// often in one direction as in the other: solids, also hollow ones and several that meet or overlap, whether
/// or not their corners are shared by index. A point lies inside where the surface winds around it, whichever
/// way its fronts face. Of an open geometry no sign is known: its distances are answered without one.
struct NearestQueryOptions {
  using Prepared = NearestQuery;
  std::string name{};
  std::uint32_t capacity = 0;  ///< points in a batch
  NearestTarget target = NearestTarget::surface;
  std::uint32_t k = 1;     ///< answers to a point: 1 to max_neighbors
  bool is_signed = false;  ///< for surface and triangle; refused for the other targets
  LatePolicy late = LatePolicy::discard;
};

class NearestQuery : public Query {
 public:
  virtual std::span<Nearest> points() noexcept = 0;
  virtual std::span<const NearestAnswer> answers() const noexcept = 0;
};

// ---- overlap

class OverlapQuery;

/// Which entities' oriented bounds overlap (touching counts) the given entity's at time t: the broad phase of
/// the paper's Intersection Query. The entity itself is never in its answer; it has to have a geometry (no_geometry).
struct Overlap {
  EntityId entity{};
  WorldTime t{};
  std::uint32_t mask = mask_all;  ///< which others are looked at
};

/// The same form as a region's answer.
using OverlapAnswer = RegionAnswer;

struct OverlapQueryOptions {
  using Prepared = OverlapQuery;
  std::string name{};
  std::uint32_t capacity = 0;
  std::uint32_t ids_per_entity = 64;  ///< 0: the query only counts, which is faster
  LatePolicy late = LatePolicy::discard;
};

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

/// The options of a query of any kind (rtstdb/query_kinds.def).
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) , Class##Options
using AnyQueryOptions = detail::VariantOfRest<void
#include <rtstdb/query_kinds.def>
                                              >::type;
#undef QUERY_KIND

const char* to_string(LatePolicy policy) noexcept;
const char* to_string(RayMode mode) noexcept;
const char* to_string(Faces faces) noexcept;
const char* to_string(HitStatus status) noexcept;
const char* to_string(RegionLevel level) noexcept;
const char* to_string(RegionShape shape) noexcept;
const char* to_string(RegionTest test) noexcept;
const char* to_string(NearestTarget target) noexcept;

}  // namespace rtstdb
