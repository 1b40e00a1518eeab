#pragma once
// The oracle: slow, exact answers in double precision to every query, independent of the GPU's code, and an
// honest judgement of a single-precision answer against them.
//
// Threads: a World is constant after it is made; all functions are pure: any number of threads. They
// allocate. Bad input (unknown carrier, a direction without length, NaN) is for the engine to refuse: here it
// is misuse and asserts.
//
// How an answer is judged. Single precision knows a point of the query only within `noise_m`, the sum of the
// magnitudes that take part (distances from the world's origin, the way along the ray, the entity's reach and
// path since the last whole second, or since its motion began in it) times noise_factor units in the last place:
//     agrees     the same answer within the tolerances below
//     too_close  another answer, but moving the query by noise_m could have made it right
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
#include "rtstdb/oracle/mesh_tree.hpp"

namespace rtstdb::oracle {

/// The rows of one version with their geometry.
class World {
 public:
  /// `entities`: as Database::snapshot gives them, ascending by index. `meshes`: by GeometryId::index; those
  /// that no entity uses may be null. The meshes are copied. `version_time`: from when the version holds.
  World(std::vector<EntityState> entities, std::span<const TriangleMesh* const> meshes,
        WorldTime version_time = {});
  /// Other rows over the same geometry, without building its trees again.
  World with_entities(std::vector<EntityState> entities, WorldTime version_time) const;

  std::span<const EntityState> entities() const noexcept { return entities_; }
  /// Misuse for an entity without geometry.
  const MeshTree& mesh_of(const EntityState& entity) const noexcept;
  /// The live entity of that id, or null.
  const EntityState* find(EntityId id) const noexcept;
  WorldTime version_time() const noexcept { return version_time_; }

 private:
  World(std::vector<EntityState> entities, std::vector<std::shared_ptr<const MeshTree>> meshes,
        WorldTime version_time);

  std::vector<EntityState> entities_;
  std::vector<std::shared_ptr<const MeshTree>> meshes_;
  WorldTime version_time_;
};

// ---- ray

/// A RayHit in double precision, and how close the decision was. On a miss the margins are zero.
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
/// differ by less than 1e-12 of themselves (a shared edge, two coinciding faces) the lowest entity index,
/// then the lowest triangle index. any: `status` alone is filled. The test is watertight: a ray through a
/// shared edge or corner of a closed surface hits at least one of the triangles there. ignore_motion:
/// everything stands at its pose of the version's time; v_relative is still made of the rows' velocities.
RayTruth trace(const World& world, const Ray& ray, RayMode mode = RayMode::closest,
               bool ignore_motion = false);

/// Every hit of the ray, also the second one where two triangles meet, ascending by lambda, then entity index,
/// then triangle index.
std::vector<RayTruth> trace_all(const World& world, const Ray& ray, bool ignore_motion = false);

/// The same, looking at every triangle of every entity: proves the trees.
RayTruth trace_brute_force(const World& world, const Ray& ray, RayMode mode = RayMode::closest,
                           bool ignore_motion = false);

// ---- region and overlap

/// One entity that the mask lets through, and how it stands to the region.
struct EntityGap {
  EntityId entity;
  /// Not above zero: in the answer. touching: the separation of the two bodies along the axis that separates
  /// them best (boxes, frustum) or their distance (sphere), negative when they overlap. inside: how far the bounds
  /// stick out.
  double gap_m = 0.0;
  double noise_m = 0.0;  ///< see the top of this file
};

/// Every visible entity by ascending index, with its gap.
std::vector<EntityGap> gaps(const World& world, const Region& region);
std::vector<EntityGap> gaps(const World& world, const Overlap& overlap);

/// RegionLevel::surface: the least gap of the entity's triangles where they are asked to touch, the largest where
/// they are to lie inside. What is far away may be farther than it says.
std::vector<EntityGap> surface_gaps(const World& world, const Region& region);

/// RegionLevel::triangle: one triangle, and how it stands to the region, as EntityGap tells of bounds.
struct TriangleGap {
  EntityId entity;
  std::uint32_t triangle = 0;
  double gap_m = 0.0;
  double noise_m = 0.0;
};

/// Every visible triangle whose gap is not above its noise, by ascending entity index and triangle. Looks at all of
/// each entity whose reach comes that near.
std::vector<TriangleGap> triangle_gaps(const World& world, const Region& region);

/// The answer drawn from the gaps: those whose gap is not above zero.
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

/// The answer to one point, as the options' target, k and is_signed ask for it; distances that differ by less
/// than 1e-12 of the magnitudes are the same.
std::vector<NeighborTruth> nearest(const World& world, const Nearest& point,
                                   const NearestQueryOptions& options);

/// The same, looking at every triangle of every entity: proves the trees.
std::vector<NeighborTruth> nearest_brute_force(const World& world, const Nearest& point,
                                               const NearestQueryOptions& options);

// ---- judging an answer

enum class Verdict : std::uint8_t { agrees, too_close, differs };

struct Judgement {
  Verdict verdict = Verdict::agrees;
  std::string reason;  ///< one sentence with the values unless it agrees
};

/// Rounding units (2^-24) per metre of magnitude that single precision is allowed.
inline constexpr double noise_factor = 32.0;
inline constexpr double lambda_relative_tolerance = 1e-4;
/// Tilt of the normal, beside what a sliver's own corners and a fast rotation leave open.
inline constexpr double normal_tolerance = 1e-3;
/// Of the sum of the speeds that make up v_relative.
inline constexpr double velocity_relative_tolerance = 1e-4;

/// Same entity and triangle: lambda within lambda_relative_tolerance or noise_m along the ray, the point that
/// u and v name within noise_m, normal and velocity within theirs, same side. Otherwise the claimed triangle
/// must pass within noise_m of the ray, in range, and no hit that noise_m can not undo may lie in front of it
/// (or be there at all, for a claimed miss; any may, for one of RayMode::first). An incomplete answer differs.
Judgement compare(const World& world, const Ray& ray, RayMode mode, bool ignore_motion, const RayTruth& truth,
                  const RayHit& answer);

/// The answer to one ray of RayMode::first; `truth`: trace_all. Hits come first, ascending by lambda and no triangle
/// twice, then misses. Each hit is judged as above within the noise of its lambda; every hit of the truth that lies in front
/// of the last answered one (or anywhere, when there was room left) and not within its noise of an edge is
/// there.
Judgement compare_first(const World& world, const Ray& ray, bool ignore_motion,
                        std::span<const RayTruth> truth, std::span<const RayHit> answers);

/// Ids strictly ascending; each with a gap below -noise_m is there, none above noise_m is; `found` is their
/// number; when `overflow` is set, `entities` is the beginning of such a list and shorter than `found`.
Judgement compare(std::span<const EntityGap> truth, const RegionAnswer& answer);
/// The same for `triangles`.
Judgement compare(std::span<const TriangleGap> truth, const RegionAnswer& answer);

/// In order and each once; each within its noise as far away as it says, its point on the target and at that
/// distance, named by u and v, its velocity and its sign right (the sign of a distance below noise_m is left
/// open). Whoever is missing is not nearer than the last, or than the radius where less than k are listed, by
/// more than noise. The same targets in the same order agree. An incomplete answer differs.
Judgement compare(const World& world, const Nearest& point, const NearestQueryOptions& options,
                  std::span<const NeighborTruth> truth, const NearestAnswer& answer);

}  // namespace rtstdb::oracle
