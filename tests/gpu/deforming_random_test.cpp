// Random shapes over many versions: queries of all kinds at the kept versions are compared with the oracle.

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

#include "tests/gpu/deforming_fixture.hpp"
#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {
namespace {

/// Waves on the surface, random positions, or other shapes.
Positions deformed(const TriangleMesh& mesh, Random& random) {
  Positions positions = mesh.positions_m;
  const std::size_t kind = random.below(8);
  const glm::vec3 wave(random.vector());
  const glm::vec3 aside(0.5 * random.vector());
  for (glm::vec3& p : positions) {
    if (kind < 4) p += 0.4f * std::sin(3.0f * glm::dot(p, wave)) * glm::normalize(wave);
    if (kind == 4) p = glm::vec3(0.7 * random.vector());
    if (kind == 5) p = aside + 0.3f * p;
    if (kind == 6) p += 0.05f * glm::vec3(random.vector());
    if (kind == 7) p *= glm::vec3(4.0f, 0.05f, 1.0f);
  }
  return positions;
}

class DeformingWorlds : public DeformingGeometry {
 protected:
  /// Entities with fixed and with deforming geometry.
  void fill(WorldTime time, std::uint32_t retained_shapes) {
    options_ = {.radius_m = 4.0, .version_time = time};
    std::vector<GeometryId> geometries;
    std::vector<TriangleMesh> meshes = mixed_meshes(random_);
    meshes.push_back(make_sphere(1.0, 4));
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      const bool deforms = i % 2 == 0 || i + 1 == meshes.size();
      const GeometryId id =
          deforms ? add_deforming(meshes[i], {.retained_shapes = retained_shapes}) : add(meshes[i]);
      geometries.push_back(id);
      if (deforms) deforming_.push_back({id, meshes[i]});
    }
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < 40; ++i)
      rows.push_back(random_row(random_, geometries, options_, rows));
    ids_ = create(rows, time);
    rows_ = rows;
  }
  /// Commits new shapes of some geometries and new rows of some entities.
  Version change(WorldTime time) {
    const auto transaction =
        database().make_transaction({.max_writes = 8, .max_geometry_updates = 32, .max_positions = 200'000});
    transaction->begin(terms_at(time));
    for (const auto& [id, mesh] : deforming_)
      if (random_.one_in(2)) transaction->update_geometry(id, deformed(mesh, random_));
    transaction->update_geometry(deforming_.back().first, deformed(deforming_.back().second, random_));
    for (int i = 0; i < 4; ++i) {
      const std::size_t body = random_.below(ids_.size());
      transaction->update(ids_[body], rows_[random_.below(rows_.size())]);
    }
    const Outcome& outcome = database().execute(*transaction);
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    return outcome.version;
  }
  /// Compares queries of all kinds at a version with the oracle.
  Tally run_all_kinds(Version version, WorldTime time, std::size_t count) {
    const ReadAt at = ReadAt::pinned(version);
    const oracle::World oracle_world = world(at);
    std::vector<Ray> rays(count);
    for (Ray& ray : rays)
      ray = random_ray(random_, oracle_world.entities(), options_, time, 0.2);
    Tally tally = judge(oracle_world, rays, trace(rays, at));
    for (const auto& query : queries_) {
      query->fill(random_, {oracle_world.entities(), options_, time, 0.2});
      const Outcome outcome = run(query->query(), query->capacity(), at);
      EXPECT_TRUE(outcome.done()) << query->name() << ": " << describe(outcome);
      queried_ += query->capacity();
      judged_ += query->judge(oracle_world, true).elements;
    }
    return tally;
  }
  void prepare_all() {
    for (const AnyQueryOptions& options : all_tested_options()) {
      // All bodies overlap: a contact query has up to thousands of triangle pairs for each of them.
      queries_.push_back(prepare_case(database(), with(options, is_expensive(options) ? 2 : 32)));
    }
  }

  Random random_{21};
  SceneOptions options_;
  std::vector<std::pair<GeometryId, TriangleMesh>> deforming_;
  std::vector<EntityId> ids_;
  std::vector<EntityRow> rows_;
  std::vector<std::unique_ptr<KindCase>> queries_;
  std::size_t queried_ = 0;
  std::size_t judged_ = 0;  ///< complete answers
};

TEST_F(DeformingWorlds, AgreeWithTheOracleAtEveryKeptVersion) {
  const WorldTime time = at_s(5.0);
  fill(time, 4);
  prepare_all();
  std::vector<Version> versions{database().latest().version};
  Tally tally = run_all_kinds(versions.back(), time, 200);
  for (int round = 0; round < 25; ++round) {
    versions.push_back(change(time));
    if (round % 2 == 0) continue;  // queries take most of the time, and versions stay readable
    // Four shapes are kept of the geometry that changes in each version.
    const std::size_t age = random_.below(std::min<std::size_t>(4, versions.size()));
    tally += run_all_kinds(versions[versions.size() - 1 - age], time, 400);
    if (HasFailure()) FAIL() << "round " << round << ", " << age << " versions back";
  }
  EXPECT_GT(tally.hits, tally.elements / 5);
  EXPECT_LT(tally.hits, tally.elements * 4 / 5);
  EXPECT_GT(judged_, queried_ * 99 / 100) << "only triangles in a tangle may take too many steps";
  const ShapeCounts counts = database().shape_counts();
  EXPECT_GT(counts.refits, 25u);
  EXPECT_GT(counts.rebuilds, 3u);
}

}  // namespace
}  // namespace rtstdb::test
