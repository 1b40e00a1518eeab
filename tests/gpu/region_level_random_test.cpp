// Random regions of the levels surface and triangle in random worlds: each answer is compared with the
// oracle.

#include <algorithm>
#include <ostream>
#include <string>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  std::uint64_t seed;
  std::uint32_t entities;
  double radius_m;
  RegionLevel level;
  std::uint32_t ids_per_region;
  std::size_t regions;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

constexpr std::uint32_t long_lists = 32'768;

constexpr Case cases[] = {
    {"triangles_of_one", 51, 1, 0.5, RegionLevel::triangle, long_lists, 40'000},
    {"triangles_of_forty", 52, 40, 4.0, RegionLevel::triangle, long_lists, 20'000},
    {"triangles_of_forty_in_short_lists", 53, 40, 4.0, RegionLevel::triangle, 7, 10'000},
    {"triangles_of_six_hundred", 54, 600, 20.0, RegionLevel::triangle, long_lists, 4'000},
    {"triangles_of_three_thousand", 55, 3000, 50.0, RegionLevel::triangle, long_lists, 1'000},
    {"surfaces_of_one", 56, 1, 0.5, RegionLevel::surface, 4, 20'000},
    {"surfaces_of_forty", 57, 40, 4.0, RegionLevel::surface, 64, 10'000},
    {"surfaces_of_forty_in_short_lists", 58, 40, 4.0, RegionLevel::surface, 2, 10'000},
    {"surfaces_of_six_hundred", 59, 600, 20.0, RegionLevel::surface, 1'000, 4'000},
};

class RandomRegionLevels : public DatabaseTest, public testing::WithParamInterface<Case> {
 protected:
  static constexpr std::uint32_t batch = 500;
  SceneOptions options_{.radius_m = GetParam().radius_m, .version_time = at_s(77.5)};
  Random random_{GetParam().seed};

  void SetUp() override {
    DatabaseTest::SetUp();
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random_))
      geometries.push_back(add(mesh));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < GetParam().entities; ++i)
      rows.push_back(random_row(random_, geometries, options_, rows));
    create(rows, options_.version_time);
  }

  /// About as large as the entities and near one of them, so that its border runs among the triangles.
  Region random_region_near_entity(std::span<const EntityState> entities, WorldTime first, double window_s) {
    Region region = random_region(random_, entities, options_, first, window_s);
    const glm::vec3 half_m = region.half_extent_m;
    const auto factor =
        static_cast<float>(random_.magnitude(0.15, 3.0)) / std::max({half_m.x, half_m.y, half_m.z});
    region.half_extent_m *= factor;
    region.near_m = std::min(factor * region.near_m, region.half_extent_m.x);
    region.center_m = 0.7 * random_.vector();
    if (region.shape == RegionShape::frustum)
      region.center_m -= glm::normalize(region.q) * glm::vec3(0.6f * region.half_extent_m.x, 0.0f, 0.0f);
    if (region.carrier.valid()) return region;
    const EntityState& one = entities[random_.below(entities.size())];
    region.center_m += glm::vec3(pose_at(one.row.motion, region.t).p_world_m);
    return region;
  }
};

TEST_P(RandomRegionLevels, AgreeWithTheOracle) {
  const auto query = prepare(RegionQueryOptions{.name = "regions",
                                                .capacity = batch,
                                                .level = GetParam().level,
                                                .ids_per_region = GetParam().ids_per_region});
  const oracle::World oracle_world = world();
  Tally tally;
  for (std::size_t done = 0; done < GetParam().regions && !HasFailure(); done += batch) {
    // One batch in four is at one instant.
    const double window_s = random_.one_in(4) ? 0.0 : random_.uniform(0.0, 1.0);
    const WorldTime first = options_.version_time + Nanoseconds(random_.below(2) * 5'300'000'000);
    for (Region& region : query->regions())
      region = random_region_near_entity(oracle_world.entities(), first, window_s);
    const Outcome outcome = run(*query, batch);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    tally += judge(oracle_world, query->regions(), query->answers(), GetParam().level);
  }
  EXPECT_GE(tally.elements, HasFailure() ? 0 : GetParam().regions);
  EXPECT_TRUE(HasFailure() || (tally.hits > tally.elements / 5 && tally.hits < tally.elements * 4 / 5))
      << tally.hits << " of " << tally.elements << " regions find something";
  EXPECT_LT(tally.too_close, tally.elements / 50);
  RecordProperty("found_something", std::to_string(tally.hits));
  EXPECT_EQ(tally.full > 0, GetParam().ids_per_region < 10 && GetParam().entities > 1);
  RecordProperty("too_close", std::to_string(tally.too_close));
}

INSTANTIATE_TEST_SUITE_P(Worlds, RandomRegionLevels, testing::ValuesIn(cases),
                         [](const auto& test_case) { return std::string(test_case.param.name); });

using RegionBorders = DatabaseTest;

/// Thin and other triangles, one of ten without area.
TriangleMesh slivers(Random& random, std::uint32_t count) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::dvec3 a_m = random.vector();
    const glm::dvec3 along_m = random.magnitude(1e-3, 2.0) * random.direction();
    const glm::dvec3 aside_m = random.magnitude(1e-6, 1.0) * random.direction();
    const double share = random.one_in(2) ? 0.5 : 0.0;
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.insert(mesh.positions_m.end(), {a_m, a_m + along_m, a_m + share * along_m + aside_m});
    mesh.triangles.emplace_back(first, first + 1, i % 10 == 9 ? first : first + 2);
  }
  return mesh;
}

/// Regions that are scaled until they just touch a triangle, and then a little more or less. Some edges of
/// regions are nearly parallel to edges of triangles.
TEST_F(RegionBorders, AgreeWithTheOracle) {
  Random random(61);
  const SceneOptions options{.radius_m = 3.0, .version_time = at_s(5.0)};
  std::vector<EntityRow> rows;
  for (int i = 0; i < 4; ++i) {
    const GeometryId geometry = add(i < 3 ? slivers(random, 60) : make_box({1.0, 1.0, 1.0}));
    rows.push_back(random_row(random, std::span(&geometry, 1), options, {}));
    if (random.one_in(2)) rows.back().motion = rebased({.valid_from = options.version_time}, at_s(4.0));
  }
  const auto ids = create(rows, options.version_time);
  const oracle::World oracle_world = world();
  constexpr std::uint32_t batch = 500;
  const auto query = prepare(RegionQueryOptions{
      .name = "borders", .capacity = batch, .level = RegionLevel::triangle, .ids_per_region = 512});
  const auto regions = query->regions();
  Tally tally;
  for (int round = 0; round < 6; ++round) {
    for (Region& region : regions) {
      region = random_region(random, oracle_world.entities(), options, options.version_time, 0.3);
      region.near_m = 0.0f;
      region.mask = mask_all;
      if (random.one_in(3)) region.q = {1.0f, random.one_in(2) ? 0.0f : 1e-3f, 0.0f, 0.0f};
      if (random.one_in(3)) region.carrier = ids[random.below(ids.size())];
      const glm::vec3 full_m = region.half_extent_m * (20.0f / region.half_extent_m.x);
      // A larger region that touches finds more.
      region.test = RegionTest::touching;
      double none = 0.0;
      double some = 1.0;
      for (int step = 0; step < 22; ++step) {
        const double middle = 0.5 * (none + some);
        region.half_extent_m = static_cast<float>(middle) * full_m;
        (oracle::found(oracle::triangle_gaps(oracle_world, region)).empty() ? none : some) = middle;
      }
      const double off = random.magnitude(1e-7, 1e-2) * (random.one_in(2) ? 1.0 : -1.0);
      region.half_extent_m = static_cast<float>(some * (1.0 + off)) * full_m;
    }
    const Outcome outcome = run(*query, batch);
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    tally += judge(oracle_world, regions, query->answers(), RegionLevel::triangle);
  }
  EXPECT_TRUE(tally.hits > tally.elements / 5 && tally.hits < tally.elements * 4 / 5) << tally.hits;
  EXPECT_LT(tally.too_close, tally.elements / 4);
  RecordProperty("found_something", std::to_string(tally.hits));
  RecordProperty("too_close", std::to_string(tally.too_close));
}

/// Triangles so thin that single precision does not determine their normals, each with a small region around
/// one of its points.
TEST_F(RegionBorders, FindThinTriangles) {
  Random random(62);
  constexpr std::uint32_t batch = 600;
  TriangleMesh mesh;
  std::vector<glm::vec3> points_m;
  for (std::uint32_t i = 0; i < batch; ++i) {
    const glm::dvec3 along = random.direction();
    const glm::dvec3 aside = glm::normalize(glm::cross(along, random.vector()));
    const glm::dvec3 center_m = 4.0 * random.vector();
    const double half_m = random.uniform(2.0, 6.0);
    const double share = random.uniform(-0.9, 0.9);
    mesh.positions_m.insert(mesh.positions_m.end(),
                            {center_m - half_m * along, center_m + half_m * along,
                             center_m + share * half_m * along + random.magnitude(1e-6, 1e-3) * aside});
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    points_m.emplace_back(center_m + random.uniform(-0.9, 0.9) * half_m * along);
  }
  create(row_of(add(mesh)));
  const auto query = prepare(RegionQueryOptions{
      .name = "slivers", .capacity = batch, .level = RegionLevel::triangle, .ids_per_region = 64});
  for (const RegionShape shape : {RegionShape::box, RegionShape::sphere, RegionShape::frustum}) {
    const auto regions = query->regions();
    for (std::uint32_t i = 0; i < batch; ++i) {
      regions[i] =
          region_of(shape, RegionTest::touching, {}, glm::vec3(glm::dvec3(random.magnitude(1e-4, 1e-2))));
      regions[i].q = random.orientation();
      const float ahead_m = shape == RegionShape::frustum ? 0.75f * regions[i].half_extent_m.x : 0.0f;
      regions[i].center_m = points_m[i] - glm::normalize(regions[i].q) * glm::vec3(ahead_m, 0.0f, 0.0f);
    }
    const Outcome outcome = run(*query, batch);
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    const Tally tally = judge(world(), regions, query->answers(), RegionLevel::triangle);
    EXPECT_EQ(tally.hits, batch);
    EXPECT_LT(tally.too_close, batch / 10);
  }
}

}  // namespace
}  // namespace rtstdb::test
