#pragma once
// The oracle: slow, exact answers in double precision to every query, independent of the GPU's code, and the
// judgement of a single-precision answer against them.
//
// Threads: a World is constant after its creation, and all functions are pure: any number of threads. They
// allocate. The engine refuses bad input (unknown carrier, a direction without length, NaN); here it is
// misuse and asserts.
//
// Judgement. Single precision determines a point of the query only within `noise_m`: the sum of the
// magnitudes involved (distances from the world's origin, distance along the ray, the entity's extent, and
// its path since the last whole second or since its motion began) times noise_factor units in the last place.
//     agrees     the same answer within the tolerances below
//     too_close  another answer, which moving the query by noise_m could make right
//     differs    wrong
// Tests count too_close and assert that it is rare.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/query.hpp>

#include "rtstdb/geometry/motion_bounds.hpp"
#include "rtstdb/oracle/convex_pieces.hpp"
#include "rtstdb/oracle/mesh_tree.hpp"

namespace rtstdb::oracle {

/// The rows of one version with their geometry.
class World {
 public:
  /// `entities`: ascending by index, as from Database::snapshot. `meshes`: by GeometryId::index, copied; null
  /// is allowed where no entity uses the geometry. `version_time`: from when the version is valid.
  World(std::vector<EntityState> entities, std::span<const TriangleMesh* const> meshes,
        WorldTime version_time = {});
  /// Other rows with the same geometry, whose trees are shared.
  World with_entities(std::vector<EntityState> entities, WorldTime version_time) const;

  std::span<const EntityState> entities() const noexcept { return entities_; }
  /// Misuse for an entity without geometry.
  const MeshTree& mesh_of(const EntityState& entity) const noexcept;
  /// The live entity of that id, or null.
  const EntityState* find(EntityId id) const noexcept;
  WorldTime version_time() const noexcept { return version_time_; }
  /// This geometry does not consist of convex parts, whatever its shape.
  void mark_deforming(GeometryId geometry);
  /// Whether the geometry is closed. Misuse for an entity without geometry.
  bool has_inside(const EntityState& entity) const noexcept;
  /// The convex parts of the entity, whose contacts are searched; none if its geometry deforms. Misuse for an
  /// entity without geometry.
  std::span<const ConvexPiece> parts_of(const EntityState& entity) const noexcept;

 private:
  World(std::vector<EntityState> entities, std::vector<std::shared_ptr<const MeshTree>> meshes,
        WorldTime version_time);

  std::vector<EntityState> entities_;
  std::vector<std::shared_ptr<const MeshTree>> meshes_;
  std::vector<std::vector<ConvexPiece>> pieces_;  // by geometry
  WorldTime version_time_;
};

// ---- ray

/// A RayHit in double precision, with the margins of the decision. On a miss the margins are zero.
struct RayTruth {
  HitStatus status = HitStatus::miss;
  double lambda = 0.0;
  double u = 0.0, v = 0.0;
  EntityId entity;
  std::uint32_t triangle = 0;
  bool front_face = false;
  glm::dvec3 n_world{0.0};
  glm::dvec3 v_relative_mps{0.0};

  double incidence_cosine = 0.0;  ///< |cos| of the angle between ray and normal
  double edge_distance_m = 0.0;   ///< from the hit point to the nearest edge of its triangle
  double noise_m = 0.0;           ///< see the top of this file
};

/// The answer to one ray. closest: the smallest lambda in [lambda_min, lambda_max]; among hits whose lambdas
/// differ by a relative 1e-12 at most (a shared edge, two coinciding faces) the lowest entity index, then the
/// lowest triangle index. any: only `status` is set. The test is watertight: a ray through a shared edge or
/// corner of a closed surface hits at least one of the triangles there. ignore_motion: every entity has its
/// pose of the version's time; v_relative still uses the rows' velocities.
RayTruth trace(const World& world, const Ray& ray, RayMode mode = RayMode::closest,
               bool ignore_motion = false);

/// Every hit of the ray, both hits where two triangles share an edge included, ascending by lambda, then
/// entity index, then triangle index.
std::vector<RayTruth> trace_all(const World& world, const Ray& ray, bool ignore_motion = false);

/// As the function above, but tests every triangle of every entity: verifies the trees.
RayTruth trace_brute_force(const World& world, const Ray& ray, RayMode mode = RayMode::closest,
                           bool ignore_motion = false);

// ---- region and overlap

/// One entity that the mask admits, and its gap to the region.
struct EntityGap {
  EntityId entity;
  /// Not above zero: in the answer. touching: the largest separation of the two bodies along a separating
  /// axis (boxes, frustum) or their distance (sphere), negative when they overlap. inside: how far the bounds
  /// reach out of the region.
  double gap_m = 0.0;
  double noise_m = 0.0;  ///< see the top of this file
};

/// Every visible entity by ascending index, with its gap.
std::vector<EntityGap> gaps(const World& world, const Region& region);
std::vector<EntityGap> gaps(const World& world, const Overlap& overlap);

/// RegionLevel::surface: the smallest gap of the entity's triangles for touching, the largest for inside. For
/// a far entity the gap may be too small.
std::vector<EntityGap> surface_gaps(const World& world, const Region& region);

/// RegionLevel::triangle: one triangle and its gap, as EntityGap for bounds.
struct TriangleGap {
  EntityId entity;
  std::uint32_t triangle = 0;
  double gap_m = 0.0;
  double noise_m = 0.0;
};

/// Every visible triangle whose gap is not above its noise, by ascending entity index and triangle. Tests all
/// triangles of each entity that may be that near.
std::vector<TriangleGap> triangle_gaps(const World& world, const Region& region);

/// The answer that follows from the gaps: those not above zero.
std::vector<EntityId> found(std::span<const EntityGap> gaps);
std::vector<EntityTriangle> found(std::span<const TriangleGap> gaps);

// ---- nearest

/// A Neighbor in double precision.
struct NeighborTruth {
  EntityId entity;
  std::uint32_t triangle = 0;
  double distance_m = 0.0;  ///< with its sign
  double u = 0.0, v = 0.0;
  bool has_sign = false;
  glm::dvec3 p_world_m{0.0};
  glm::dvec3 v_relative_mps{0.0};
  double noise_m = 0.0;  ///< see the top of this file
};

/// The answer to one point with the options' target, k and is_signed. Distances that differ by less than
/// 1e-12 of the magnitudes are equal.
std::vector<NeighborTruth> nearest(const World& world, const Nearest& point,
                                   const NearestQueryOptions& options);

/// As the function above, but tests every triangle of every entity: verifies the trees.
std::vector<NeighborTruth> nearest_brute_force(const World& world, const Nearest& point,
                                               const NearestQueryOptions& options);

// ---- cone

/// The first contact of a cone with an entity, in double precision.
struct ConeTruth {
  EntityId entity;
  std::uint32_t triangle = 0;
  double lambda = 0.0;
  double u = 0.0, v = 0.0;
  bool front_face = false;
  glm::dvec3 n_world{0.0};
  glm::dvec3 v_relative_mps{0.0};
  double noise_m = 0.0;  ///< see the top of this file
};

/// The first contacts with all entities in the cone, by ascending lambda, then by entity index. For an
/// opening angle of 0: the closest hits of a ray. In each cross-section of the cone the distance of a
/// triangle from the axis is a convex function of the axial coordinate; a search finds where it first falls
/// below the cone's radius.
std::vector<ConeTruth> contacts(const World& world, const Cone& cone, Faces faces = Faces::both);

/// As the function above, but tests every triangle of every entity: verifies the trees.
std::vector<ConeTruth> contacts_brute_force(const World& world, const Cone& cone, Faces faces = Faces::both);

struct BeamFraction {
  EntityId entity;
  double fraction = 0.0;
};

/// The parts of the beam's cross-section that reach each entity, from rays along `directions` directions that
/// are spread evenly over it; entities that none reaches are left out. By ascending entity index. For an
/// opening angle of 0: the first entity.
std::vector<BeamFraction> beam_fractions(const World& world, const Cone& cone, Faces faces,
                                         std::uint32_t directions);

// ---- contact

/// Whether the mesh is closed (MeshTree::closed) and convex as GeometryInfo::convex defines it for meshes
/// (MeshTree::convex).
bool is_convex(const TriangleMesh& mesh);

/// Distance or depth of two bodies, in double precision, relative to the origin of the first entity.
struct PairTruth {
  double distance_m = 0.0;  ///< negative: minus the depth
  /// Unit, from the second body to the first: of bodies that are apart, along the shortest segment; of those
  /// that penetrate, along the shortest translation of the first that separates them.
  glm::dvec3 n_world{0.0};
  glm::dvec3 p_first_m{0.0}, p_second_m{0.0};  ///< ends of the shortest segment; zero if they penetrate
  /// Greatest width of an answer's bounds as ContactQuery states it, without the term relative to the depth.
  double precision_m = 0.0;
  double ulp_m = 0.0;  ///< single precision at the larger body's largest coordinate

  /// The error that a depth may have.
  double depth_tolerance_m() const noexcept;
};

/// Tolerance of a depth, as a share of the depth; applies where it exceeds precision_m.
inline constexpr double depth_relative_tolerance = 0.01;

/// The truth of two entities with convex geometry: of the hulls of their corners. Depth: the largest gap
/// along the normals of all faces of the Minkowski difference. Distance of bodies that are apart: the least
/// of all corners and triangles, and of all pairs of edges. The time grows with the product of the numbers of
/// edges.
PairTruth pair_truth(const World& world, EntityId first, EntityId second, WorldTime t);

/// A pair that a search admits.
struct ContactCandidate {
  EntityId first, second;
  /// Distance of the oriented bounds, those of the first entity widened by the margin: a candidate where it
  /// is not above zero.
  double gap_m = 0.0;
  double noise_m = 0.0;  ///< of the bounds in world coordinates: see the top of this file
};

/// The pairs of the search in the order of an answer. Pairs whose gap is plainly above its noise are left
/// out; a named pair is not.
std::vector<ContactCandidate> contact_candidates(const World& world, const ContactSearch& search);

// ---- judging an answer

enum class Verdict : std::uint8_t { agrees, too_close, differs };

struct Judgement {
  Verdict verdict = Verdict::agrees;
  std::string reason;  ///< one sentence with the values; empty when it agrees
};

/// Rounding units (2^-24) per metre of magnitude that single precision is allowed.
inline constexpr double noise_factor = 32.0;
inline constexpr double lambda_relative_tolerance = 1e-4;
/// Tilt of the normal, in addition to the uncertainty of a sliver's corners and of a fast rotation.
inline constexpr double normal_tolerance = 1e-3;
/// Relative to the sum of the speeds that make up v_relative.
inline constexpr double velocity_relative_tolerance = 1e-4;

/// Same entity and triangle: agrees when lambda is within lambda_relative_tolerance or noise_m along the ray,
/// the point of u and v within noise_m, normal and velocity within their tolerances, and the side the same.
/// Otherwise the answered triangle must pass within noise_m of the ray, in range, and no certain hit, which
/// noise_m can not undo, may lie in front of it (for an answered miss: anywhere; for RayMode::first hits in
/// front are allowed). An incomplete answer differs.
Judgement compare(const World& world, const Ray& ray, RayMode mode, bool ignore_motion, const RayTruth& truth,
                  const RayHit& answer);

/// The answer to one ray of RayMode::first; `truth`: trace_all. Hits come first, ascending by lambda, no
/// triangle twice, then misses. Each hit is judged as above within the noise of its lambda. Every hit of the
/// truth in front of the last answered one (anywhere, when the list is not full) must be listed, unless it is
/// within its noise of an edge.
Judgement compare_first(const World& world, const Ray& ray, bool ignore_motion,
                        std::span<const RayTruth> truth, std::span<const RayHit> answers);

/// Ids ascend strictly; every id with a gap below -noise_m is listed, none with a gap above noise_m; `found`
/// is their number. With `overflow`, `entities` is the beginning of such a list and shorter than `found`.
Judgement compare(std::span<const EntityGap> truth, const RegionAnswer& answer);
/// As the function above, for `triangles`.
Judgement compare(std::span<const TriangleGap> truth, const RegionAnswer& answer);

/// Neighbors are in order and listed once. Of each, distance, point on the target, u and v, and velocity are
/// right within its noise, and so is the sign unless the distance is below noise_m. A target that is not
/// listed is not nearer by more than its noise than the last one, or than the radius where fewer than k are
/// listed. The same targets in the same order agree. An incomplete answer differs.
Judgement compare(const World& world, const Nearest& point, const NearestQueryOptions& options,
                  std::span<const NeighborTruth> truth, const NearestAnswer& answer);

/// Directions with which `judge` samples a beam, and the difference between a fraction and that of the
/// samples that is allowed.
inline constexpr std::uint32_t judged_directions = 2048;
inline constexpr double fraction_tolerance = 0.1;

/// The returns of one cone. Hits come first, by ascending lambda, no entity twice, then misses. Of each, the
/// contact lies in the cone and on the triangle, and side, normal and velocity are right, within noise.
/// lambda lies between the first contacts with a cone that is wider and one that is narrower by the noise of
/// the entity: this decides where the cone touches a surface. An entity in the narrower cone that comes
/// before the last return (anywhere, when the list is not full) must be listed. With options.fractions,
/// fractions are those of `judged_directions` directions within fraction_tolerance, and an entity must be
/// listed if its fraction exceeds that. The same entities, with lambda within lambda_relative_tolerance or
/// noise_m, agree. A return that is incomplete differs.
Judgement compare(const World& world, const Cone& cone, const ConeQueryOptions& options,
                  std::span<const ConeTruth> truth, std::span<const ConeReturn> answers);

/// One listed pair with convex geometry.
///     status    right, or the distance is within precision_m of the border to another one (too close)
///     distance  within its bounds, which contain the truth and are at most depth_tolerance_m apart. Those of
///               an undecided pair contain the truth, and the pair is too close.
///     normal    of unit length; the gap along it is the lower bound of the distance within 4 ulp_m
///     points    At half its depth before and behind each point, along the normal, are the surfaces at which
///               the bodies face one another, within depth_tolerance_m, and the named triangles. No point is
///               deeper than the pair or, beyond precision_m, farther apart than the margin, and the depth of
///               the first is minus the distance. Velocities are those of the rows.
Judgement compare(const World& world, const ContactSearch& search, const PairTruth& truth,
                  const ContactPair& answer);

/// The answer to one search; `candidates`: contact_candidates. Pairs ascend strictly, and each is judged as
/// above, or as contact_surface.hpp says if a body does not consist of convex parts. All pairs within the
/// margin are listed, and no others, except at a border within noise, undecided candidates, and pairs behind
/// the end of a list that overflowed. `found` and `candidates` are between the numbers of certain and
/// of possible pairs. They have no lower limit where the batch overflowed: if this search alone exceeds it,
/// or the list is shorter than it may be. An incomplete answer differs.
Judgement compare(const World& world, const ContactSearch& search, const ContactQueryOptions& options,
                  std::span<const ContactCandidate> candidates, const ContactAnswer& answer);

}  // namespace rtstdb::oracle
