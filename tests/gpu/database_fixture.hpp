#pragma once
// Fixture of tests of the whole database: a database on the device with the validation layer on, each message
// of which fails the test; and the comparison of answers with the oracle.

#include <gtest/gtest.h>

#include <functional>
#include <initializer_list>
#include <memory>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/gpu/device.hpp"
#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::test {

inline WorldTime at_s(double seconds) {
  return world_time_ns(static_cast<std::int64_t>(seconds * 1e9));
}

/// Counts of the answers that were compared with the oracle.
struct Tally {
  std::size_t elements = 0;
  std::size_t hits = 0;       ///< rays that hit; regions that are not empty; complete lists of neighbors
  std::size_t too_close = 0;  ///< answers that rounding decides: the oracle accepts either
  std::size_t full = 0;       ///< rays with all the hits that the query lists; regions that overflowed
  std::size_t inside = 0;     ///< points with a negative distance
  Tally& operator+=(const Tally& other);
};

class DatabaseTest : public testing::Test {
 protected:
  /// Opens a database with default options.
  void SetUp() override { open({}); }
  void TearDown() override;

  /// Replaces the database. It has the validation layer and uses the device that HIL_TEST_GPU selects, which
  /// all tests of a process share unless `device` names a loader.
  void open(DatabaseOptions options, gpu::DeviceOptions device = {});
  Database& database() { return *database_; }
  GeometryId add(const TriangleMesh& mesh);

  /// Executes a transaction that `declare` fills.
  Outcome execute(const std::function<void(Transaction&)>& declare, WorldTime world_time = {},
                  const ReadAt& read_at = {});
  /// Commits one version with these rows.
  std::vector<EntityId> create(std::span<const EntityRow> rows, WorldTime world_time = {});
  EntityId create(const EntityRow& row, WorldTime world_time = {});
  void update_motion(EntityId entity, const Motion& motion, WorldTime world_time);
  void remove(EntityId entity, WorldTime world_time);

  /// Fails the test and returns null if the query can not be prepared.
  template <class Options>
  std::unique_ptr<typename Options::Prepared> prepare(const Options& options) {
    auto query = database().prepare(options);
    if (query) return std::move(query).value();
    ADD_FAILURE() << query.error().message;
    return nullptr;
  }
  /// Executes a transaction with the first `count` elements of the query.
  Outcome run(Query& query, std::size_t count, const ReadAt& read_at = {});

  std::unique_ptr<RayQuery> prepare_rays(RayMode mode = RayMode::closest, bool ignore_motion = false,
                                         std::uint32_t capacity = 4096);
  /// Traces in batches of the query's capacity.
  std::vector<RayHit> trace(RayQuery& query, std::span<const Ray> rays, const ReadAt& read_at = {});
  /// The closest hits. Traces the first 4096 rays also as packets of equal rays and compares the bits.
  std::vector<RayHit> trace(std::span<const Ray> rays, const ReadAt& read_at = {});
  RayHit trace(const Ray& ray, const ReadAt& read_at = {});

  /// The oracle's copy of a version.
  oracle::World world(const ReadAt& read_at = {});

 private:
  std::unique_ptr<Database> database_;
  std::unique_ptr<RayQuery> closest_;
};

bool same_bits(const RayHit& a, const RayHit& b);

/// Compares each answer with the oracle, on all processors. Fails the test for each that differs.
Tally judge(const oracle::World& world, std::span<const Ray> rays, std::span<const RayHit> hits,
            RayMode mode = RayMode::closest, bool ignore_motion = false);
Tally judge(const oracle::World& world, std::span<const Ray> rays, std::span<const RayHit> hits,
            const RayQueryOptions& options);
Tally judge(const oracle::World& world, std::span<const Region> regions,
            std::span<const RegionAnswer> answers, const RegionQueryOptions& options);
Tally judge(const oracle::World& world, std::span<const Region> regions,
            std::span<const RegionAnswer> answers, RegionLevel level = RegionLevel::bounds);
Tally judge(const oracle::World& world, std::span<const Overlap> overlaps,
            std::span<const OverlapAnswer> answers, const OverlapQueryOptions& options = {});
Tally judge(const oracle::World& world, std::span<const Nearest> points,
            std::span<const NearestAnswer> answers, const NearestQueryOptions& options);

/// Hits: cones with a return. Full: those with returns_per_cone of them.
Tally judge(const oracle::World& world, std::span<const Cone> cones, std::span<const ConeReturn> returns,
            const ConeQueryOptions& options);

/// Hits: searches with a pair that touches or is within the margin. Full: those that overflowed.
Tally judge(const oracle::World& world, std::span<const ContactSearch> searches,
            std::span<const ContactAnswer> answers, const ContactQueryOptions& options);

/// Hits: searches with an impact.
Tally judge(const oracle::World& world, std::span<const ImpactSearch> searches,
            std::span<const ImpactAnswer> answers, const ImpactQueryOptions& options);

/// Hits: images in which something is seen.
Tally judge(const oracle::World& world, std::span<const Camera> cameras, std::span<const Image> images,
            const ImageQueryOptions& options);

Terms terms_at(WorldTime world_time, const ReadAt& read_at = {});
EntityRow row_of(GeometryId geometry, const glm::dvec3& p_world_m = glm::dvec3(0.0));
Region region_of(RegionShape shape, RegionTest test, const glm::vec3& center_m,
                 const glm::vec3& half_extent_m);
Ray ray_from(const glm::vec3& origin_m, const glm::vec3& direction, WorldTime t = {});

}  // namespace rtstdb::test
