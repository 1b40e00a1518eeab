#pragma once
// What the tests of the whole database share: a world on the device with the validation layer on, whose every
// message fails the test, and the oracle's judgement of its answers.

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

/// How a batch of answers stands to the oracle.
struct Tally {
  std::size_t asked = 0;
  std::size_t hits = 0;  ///< rays that hit; regions that are not empty
  std::size_t too_close = 0;
  std::size_t full = 0;    ///< as much was answered as was asked for; regions that overflowed
  std::size_t inside = 0;  ///< points inside of what is nearest to them, by its sign
  Tally& operator+=(const Tally& other);
};

class DatabaseTest : public testing::Test {
 protected:
  /// Opens a database of the default size; tests that need another call open themselves.
  void SetUp() override { open({}); }
  void TearDown() override;

  /// With the validation layer on and on the device that HIL_TEST_GPU chooses.
  /// All tests of a process share the device.
  void open(DatabaseOptions options, gpu::DeviceOptions device = {});
  Database& database() { return *database_; }
  GeometryId add(const TriangleMesh& mesh);

  /// Declares, carries out and gives the outcome.
  Outcome execute(const std::function<void(Transaction&)>& declare, WorldTime world_time = {},
                  const ReadAt& read_at = {});
  /// One version with these rows; fails the test unless it is committed.
  std::vector<EntityId> create(std::span<const EntityRow> rows, WorldTime world_time = {});
  EntityId create(const EntityRow& row, WorldTime world_time = {});
  void update_motion(EntityId entity, const Motion& motion, WorldTime world_time);
  void remove(EntityId entity, WorldTime world_time);

  std::unique_ptr<RayQuery> prepare_rays(RayMode mode = RayMode::closest, bool ignore_motion = false,
                                         std::uint32_t capacity = 4096);
  /// In batches of the query's capacity; fails the test unless the outcome is committed.
  std::vector<RayHit> trace(RayQuery& query, std::span<const Ray> rays, const ReadAt& read_at = {});
  /// For the nearest hits; the first few thousand also as packets, each ray beside itself, with the same
  /// bits.
  std::vector<RayHit> trace(std::span<const Ray> rays, const ReadAt& read_at = {});
  RayHit trace(const Ray& ray, const ReadAt& read_at = {});

  /// The oracle's copy of a version.
  oracle::World world(const ReadAt& read_at = {});

 private:
  std::unique_ptr<Database> database_;
  std::unique_ptr<RayQuery> closest_;
};

bool same_bits(const RayHit& a, const RayHit& b);

/// Holds every answer against the oracle, on all processors; fails the test on each that differs.
Tally judge(const oracle::World& world, std::span<const Ray> rays, std::span<const RayHit> hits,
            RayMode mode = RayMode::closest, bool ignore_motion = false);
/// As the query was prepared: RayMode::first, and rays that see one side of triangles alone, too.
Tally judge(const oracle::World& world, std::span<const Ray> rays, std::span<const RayHit> hits,
            const RayQueryOptions& options);
Tally judge(const oracle::World& world, std::span<const Region> regions,
            std::span<const RegionAnswer> answers, const RegionQueryOptions& options);
Tally judge(const oracle::World& world, std::span<const Region> regions,
            std::span<const RegionAnswer> answers, RegionLevel level = RegionLevel::bounds);
Tally judge(const oracle::World& world, std::span<const Overlap> overlaps,
            std::span<const OverlapAnswer> answers, const OverlapQueryOptions& options = {});

/// Hits: answers with as many neighbors as were asked for.
Tally judge(const oracle::World& world, std::span<const Nearest> points,
            std::span<const NearestAnswer> answers, const NearestQueryOptions& options);

/// Hits: cones with a return. Full: those with as many returns as were asked for.
Tally judge(const oracle::World& world, std::span<const Cone> cones, std::span<const ConeReturn> returns,
            const ConeQueryOptions& options);

Terms terms_at(WorldTime world_time, const ReadAt& read_at = {});
EntityRow row_of(GeometryId geometry, const glm::dvec3& p_world_m = glm::dvec3(0.0));
Region region_of(RegionShape shape, RegionTest test, const glm::vec3& center_m,
                 const glm::vec3& half_extent_m);
Ray ray_from(const glm::vec3& origin_m, const glm::vec3& direction, WorldTime t = {});

}  // namespace rtstdb::test
