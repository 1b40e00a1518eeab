// Searches that take more rounds than a dispatch has: rays continue in further dispatches until they are
// complete; the other kinds of queries have incomplete answers, never wrong ones.

#include <algorithm>
#include <cmath>

#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {
namespace {

class SearchLimits : public DatabaseTest {
 protected:
  Outcome run_rays(RayQuery& query, std::span<const Ray> rays) {
    std::ranges::copy(rays, query.rays().begin());
    return run(query, rays.size());
  }
};

/// A ray takes at least a round for each triangle, and a dispatch has 65,535.
TEST_F(SearchLimits, ManyEqualTrianglesAreSearchedCompletely) {
  const auto query = prepare_rays();
  const auto any = prepare_rays(RayMode::any);
  EntityId before;
  for (const std::uint32_t count : {100u, 1'000u, 10'000u, 20'000u, 100'000u, 300'000u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(repeated_triangle(count)), {0.0, 0.0, 5.0}));
    const Ray through[] = {ray_from({}, {0, 0, 1}), ray_from({}, {0, 0, -1})};
    EXPECT_EQ(run_rays(*query, through).status, Status::committed) << count << " triangles";
    const RayHit& hit = query->hits()[0];
    EXPECT_EQ(hit.status, HitStatus::hit);
    EXPECT_EQ(hit.triangle, 0u) << "the lowest of the triangles that tie";
    EXPECT_EQ(hit.lambda, 5.0f);
    EXPECT_EQ(query->hits()[1].status, HitStatus::miss)
        << "a ray without hits beside a ray that tests all triangles";
    EXPECT_EQ(run_rays(*any, through).status, Status::committed);
    EXPECT_EQ(any->hits()[0].status, HitStatus::hit);
    EXPECT_EQ(any->hits()[1].status, HitStatus::miss);
  }
}

/// More rays than one retry pass continues; the last pass has fewer.
TEST_F(SearchLimits, ManyLongRaysAreCompletedInSeveralRetryPasses) {
  const EntityId near = create(row_of(add(repeated_triangle(70'000)), {0.0, 0.0, 5.0}));
  const EntityId far = create(row_of(add(repeated_triangle(80'000)), {0.0, 0.0, 9.0}));
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i < 700; ++i) {
    Ray ray = ray_from({0.001f * static_cast<float>(i) - 0.35f, 0.0f, 0.0f}, {0, 0, i % 3 == 2 ? -1 : 1});
    if (i % 3 == 1) ray.lambda_min = 6.0f;
    rays.push_back(ray);
  }
  const auto hits = trace(*prepare_rays(RayMode::closest, false, 700), rays);
  for (std::uint32_t i = 0; i < 700; ++i) {
    const EntityId expected[] = {near, far, {}};
    EXPECT_EQ(hits[i].status, i % 3 == 2 ? HitStatus::miss : HitStatus::hit) << "ray " << i;
    EXPECT_EQ(hits[i].entity, expected[i % 3]) << "ray " << i;
    EXPECT_EQ(hits[i].triangle, 0u);
  }
}

/// How a subgroup traces rays: as a packet, one ray a lane, one ray a lane with work sharing, or without
/// subgroup kernels.
enum class Kernel : std::uint8_t { packet, single, work_sharing, without_subgroups };

/// On lavapipe eight neighbouring rays of a batch share a limit of rounds. Hits must not depend on the other
/// rays, and a ray that reaches the limit must not become a miss.
class LongSearches : public SearchLimits, public testing::WithParamInterface<Kernel> {
 protected:
  static std::vector<Ray> rays(Random& random, bool coherent) {
    std::vector<Ray> rays;
    for (int i = 0; i < 64; ++i) {
      const glm::vec3 from_m(random.uniform(-3, 3), random.uniform(-3, 3), -20.0);
      const glm::vec3 direction(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 1.0);
      rays.push_back(coherent ? ray_from({0.0f, 0.0f, -20.0f}, glm::vec3(0.2f, 0.2f, 1.0f) * direction)
                              : ray_from(from_m, direction));
    }
    EXPECT_EQ(query::are_coherent(rays), coherent);
    return rays;
  }
  static void join(TriangleMesh& mesh, const TriangleMesh& other, const glm::vec3& place_m) {
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    for (const glm::vec3& position_m : other.positions_m)
      mesh.positions_m.push_back(position_m + place_m);
    for (const glm::uvec3& triangle : other.triangles)
      mesh.triangles.push_back(triangle + glm::uvec3(first));
  }
};

TEST_P(LongSearches, GiveTheSameHitsInABatchAndAlone) {
  Random random(21);
  open({}, {.use_subgroup_kernels = GetParam() != Kernel::without_subgroups});
  const EntityId wall = create(row_of(add(make_box({50.0, 50.0, 1.0})), {0.0, 0.0, 20.5}));
  // With few entities there is no work sharing.
  if (GetParam() == Kernel::work_sharing)
    create(std::vector<EntityRow>(30, row_of(add(make_box({1.0, 1.0, 1.0})), {0.0, 500.0, 0.0})));
  const std::vector<Ray> rays = LongSearches::rays(random, GetParam() == Kernel::packet);
  const auto query = prepare_rays();
  const auto any = prepare_rays(RayMode::any);
  EntityId before;
  for (const std::uint32_t count : {100'000u, 800'000u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(random_lines(random, count))));
    EXPECT_EQ(run_rays(*query, rays).status, Status::committed) << count << " lines";
    const std::vector<RayHit> in_batch(query->hits().begin(), query->hits().end());
    EXPECT_EQ(run_rays(*any, rays).status, Status::committed) << count << " lines";
    EXPECT_EQ(std::ranges::count(any->hits(), HitStatus::hit, &RayHit::status), std::ssize(rays));
    for (std::size_t i = 0; i < rays.size(); ++i) {
      EXPECT_EQ(in_batch[i].entity, wall) << "ray " << i << " of " << count << " lines";
      EXPECT_FLOAT_EQ(in_batch[i].lambda, 40.0f);
      if (i % 7 != 0) continue;
      run_rays(*query, std::span(rays).subspan(i, 1));
      EXPECT_EQ(query->hits()[0].entity, wall) << "ray " << i << " of " << count << " lines, alone";
      EXPECT_EQ(query->hits()[0].lambda, in_batch[i].lambda);
      EXPECT_EQ(query->hits()[0].triangle, in_batch[i].triangle);
      run_rays(*any, std::span(rays).subspan(i, 1));
      EXPECT_EQ(any->hits()[0].status, HitStatus::hit) << "ray " << i << " of " << count << " lines, alone";
    }
  }
}

/// A packet visits children in the order of its first ray. For the other rays, two dense meshes and a wall
/// come in another order.
TEST_F(SearchLimits, HitsDoNotDependOnTheFirstRayOfAPacket) {
  for (const RayMode mode : {RayMode::closest, RayMode::any}) {
    open({});
    const GeometryId dense = add(repeated_triangle(100'000));
    for (const glm::dvec3 place_m :
         {glm::dvec3(-0.243483, 1.297308, 9.640508), glm::dvec3(0.756596, -1.575662, -2.423214)}) {
      EntityRow row = row_of(dense, place_m);
      row.scale = glm::dvec3(10.0);
      create(row);
    }
    create(row_of(add(make_box({40.0, 40.0, 0.2})), {-2.434557, 2.457633, -5.050840}));
    const auto query =
        prepare(RayQueryOptions{.name = "fronts", .capacity = 64, .mode = mode, .faces = Faces::front});
    const Ray other = ray_from({0, 0, -20}, {0.004f, 0.004f, 1.0f});
    std::vector<Ray> rays(8, other);
    const auto status_at = [&](std::size_t place, std::size_t count) {
      std::ranges::fill(rays, other);
      rays[place] = ray_from({0, 0, -20}, {-0.005f, -0.005f, 1.0f});
      EXPECT_EQ(run_rays(*query, std::span(rays).first(count)).status, Status::committed);
      return query->hits()[place].status;
    };
    EXPECT_EQ(status_at(0, 1), HitStatus::hit);
    EXPECT_EQ(status_at(0, 8), HitStatus::hit);
    EXPECT_EQ(status_at(7, 8), HitStatus::hit);
  }
}

/// In the mode any, a single ray visits far children first and a packet near ones.
TEST_P(LongSearches, FindAnyHitBeforeAndBehindADenseMesh) {
  const TriangleMesh wall = make_box({50.0, 50.0, 0.1});
  for (const float wall_z_m : {-15.0f, 15.0f}) {
    for (const bool in_one_mesh : {false, true}) {
      Random random(21);
      std::vector<Ray> rays = LongSearches::rays(random, GetParam() == Kernel::packet);
      open({}, {.use_subgroup_kernels = GetParam() != Kernel::without_subgroups});
      TriangleMesh dense = random_lines(random, 800'000);
      if (in_one_mesh)
        join(dense, wall, {0.0f, 0.0f, wall_z_m});
      else
        create(row_of(add(wall), {0.0, 0.0, wall_z_m}));
      create(row_of(add(dense)));
      if (GetParam() == Kernel::work_sharing)
        create(std::vector<EntityRow>(30, row_of(add(make_box({1.0, 1.0, 1.0})), {0.0, 500.0, 0.0})));
      const auto any = prepare_rays(RayMode::any);
      const auto expect_hits = [&](std::span<const Ray> some) {
        EXPECT_EQ(run_rays(*any, some).status, Status::committed);
        EXPECT_EQ(std::ranges::count(any->hits(), HitStatus::hit, &RayHit::status), std::ssize(some))
            << "of " << some.size() << " rays; wall at " << wall_z_m
            << (in_one_mesh ? " m in one mesh" : " m");
      };
      expect_hits(rays);
      std::ranges::reverse(rays);
      expect_hits(rays);
      for (std::size_t i = 0; i < rays.size(); i += 9)
        expect_hits(std::span(rays).subspan(i, 1));
    }
  }
}

std::string name_of(const testing::TestParamInfo<Kernel>& kernel) {
  constexpr const char* names[] = {"Packet", "Single", "WorkSharing", "WithoutSubgroups"};
  return names[static_cast<std::size_t>(kernel.param)];
}

INSTANTIATE_TEST_SUITE_P(Kernels, LongSearches,
                         testing::Values(Kernel::packet, Kernel::single, Kernel::work_sharing,
                                         Kernel::without_subgroups),
                         name_of);

/// With work sharing, lanes may search the wall and the dense mesh behind it at the same time for one ray.
/// The dense mesh alone takes many dispatches.
TEST_F(SearchLimits, MeshesBehindAHitAreNotSearched) {
  const EntityId wall = create(row_of(add(make_box({4.0, 4.0, 0.1})), {0.0, 0.0, 2.0}));
  create(row_of(add(repeated_triangle(100'000)), {0.0, 0.0, 5.0}));
  create(std::vector<EntityRow>(20, row_of(add(make_box({1.0, 1.0, 1.0})), {0.0, 500.0, 0.0})));
  std::vector<Ray> rays;
  for (const float y : {0.0f, 0.05f, 0.1f, 0.15f, 0.2f, 0.25f, 0.3f, 0.35f})
    for (const float x : {-0.2f, -0.15f, -0.1f, -0.05f, 0.0f, 0.05f, 0.1f, 0.15f})
      rays.push_back(ray_from({x, y, -1.0f}, {0, 0, 1}));
  ASSERT_FALSE(query::are_coherent(rays));
  const auto query = prepare_rays();
  const auto any = prepare_rays(RayMode::any);
  Nanoseconds with_wall{0};
  for (const std::size_t size : {1u, 2u, 7u, 8u, 9u, 64u}) {
    const Outcome outcome = run_rays(*query, std::span(rays).first(size));
    EXPECT_EQ(outcome.status, Status::committed) << size << " rays";
    with_wall = outcome.actual_cost;
    EXPECT_EQ(run_rays(*any, std::span(rays).first(size)).status, Status::committed) << size << " rays";
    for (std::size_t i = 0; i < size; ++i) {
      EXPECT_EQ(query->hits()[i].entity, wall) << "ray " << i << " of " << size;
      EXPECT_EQ(any->hits()[i].status, HitStatus::hit) << "ray " << i << " of " << size;
    }
  }
  remove(wall, {});
  EXPECT_GT(run_rays(*query, rays).actual_cost, 10 * with_wall);
}

/// A search visits all of many coincident entities. Queries of triangles reach the limit with fewer entities.
TEST_F(SearchLimits, CoincidentEntitiesAreSearchedCompletelyOrIncomplete) {
  const std::vector<AnyQueryOptions> of_bounds{
      RegionQueryOptions{.name = "bounds", .ids_per_region = 8},
      NearestQueryOptions{.name = "centers", .target = NearestTarget::center, .k = 4},
      NearestQueryOptions{.name = "nearest bounds", .target = NearestTarget::bounds, .k = 9},
      OverlapQueryOptions{.name = "overlaps", .ids_per_entity = 8}};
  const struct {
    std::uint32_t entities;
    std::vector<AnyQueryOptions> options;
    bool some_incomplete;
  } rows[] = {
      {100, all_tested_options(), false}, {12'000, all_tested_options(), true}, {59'000, of_bounds, true}};
  for (const auto& row : rows) {
    open({.max_entities = 60'000});
    create(std::vector<EntityRow>(row.entities, row_of(add(make_box({1.0, 1.0, 1.0})))));
    const oracle::World oracle_world = world();
    std::uint32_t incomplete = 0;
    for (const AnyQueryOptions& options : row.options) {
      const auto query = prepare_case(database(), with(options, 8));
      SCOPED_TRACE(testing::Message() << row.entities << " entities, " << query->name());
      Random random(25);
      query->fill(random, {oracle_world.entities(), {.radius_m = 1.0}, {}, 0.0});
      const Outcome outcome = run(query->query(), 8);
      EXPECT_TRUE(outcome.done()) << describe(outcome);
      const std::uint32_t missing = query->query().answer_info().missing;
      EXPECT_TRUE(missing == 0 || outcome.status == Status::truncated) << describe(outcome);
      incomplete += missing;
      query->judge(oracle_world, true);
    }
    EXPECT_EQ(incomplete > 0, row.some_incomplete) << row.entities << " entities";
  }
}

/// Each level of both trees has leaves of coincident entities or triangles and one node with all smaller
/// ones, so that the traversal stack of a ray has an entry for each level.
class DeepTrees : public SearchLimits {
 protected:
  /// `turned`: the level at which one entity has an additional triangle that faces the other way; -1: none.
  void fill(int levels, std::size_t copies, int turned = -1) {
    TriangleMesh mesh;
    for (int level = 0; level < levels; ++level) {
      const auto x = static_cast<float>(1.0 - std::exp2(-level));
      const float size = 20.0f - 0.8f * static_cast<float>(level);
      const float height = 0.1f + 0.005f * static_cast<float>(level);
      const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
      mesh.positions_m.insert(mesh.positions_m.end(),
                              {{x - size, -size, -height}, {x + size, -size, height}, {x, size, 0.0f}});
      mesh.triangles.insert(mesh.triangles.end(), copies, {first, first + 1, first + 2});
    }
    const GeometryId geometry = add(mesh);
    std::vector<EntityRow> rows;
    for (int level = 0; level < levels; ++level) {
      EntityRow row = row_of(geometry, {1.0 - std::exp2(-level), 0.0, 0.0});
      row.scale = glm::dvec3(1.0 - 0.02 * level);
      rows.insert(rows.end(), copies, row);
    }
    if (turned >= 0) {
      const auto first = static_cast<std::uint32_t>(3 * turned);
      mesh.triangles.emplace_back(first, first + 2, first + 1);
      rows[copies * static_cast<std::size_t>(turned + 1) - 1].geometry = add(mesh);
    }
    create(rows);
  }
  static Ray through() { return ray_from({0.5f, 0.1f, -5.0f}, {0, 0, 1}); }
};

TEST_F(DeepTrees, AreSearchedCompletely) {
  fill(21, 64);
  const auto query = prepare_rays();
  const Ray rays[] = {through(), ray_from({500.0f, 0.1f, -5.0f}, {0, 0, 1})};
  EXPECT_EQ(run_rays(*query, rays).status, Status::committed);
  EXPECT_EQ(query->hits()[0].status, HitStatus::hit);
  EXPECT_EQ(query->hits()[1].status, HitStatus::miss);
}

/// The Morton code of each center differs from all later ones in one further bit, for all bits of the code;
/// and each box contains all later ones.
class DeepestTrees : public SearchLimits {
 protected:
  static constexpr std::uint32_t levels = 63;
  static glm::vec3 center(std::uint32_t level) {
    glm::vec3 center;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t bits = (level + 2 - axis) / 3;
      center[static_cast<int>(axis)] =
          bits == 21 ? 1.0f : static_cast<float>(1.0 - std::exp2(-static_cast<int>(bits)));
    }
    return center;
  }
  /// From both sides; rays from one side hit nothing and visit the whole tree.
  void expect_complete_search() {
    for (const RayMode mode : {RayMode::closest, RayMode::any}) {
      for (const Faces faces : {Faces::front, Faces::back}) {
        const auto query =
            prepare(RayQueryOptions{.name = "one side", .capacity = 2, .mode = mode, .faces = faces});
        const Ray rays[] = {ray_from({0.9f, 0.8f, -9.0f}, {0, 0, 1}),
                            ray_from({0.9f, 0.8f, 9.0f}, {0, 0, -1})};
        EXPECT_EQ(run_rays(*query, rays).status, Status::committed);
        const std::size_t hitting = faces == Faces::back ? 0 : 1;
        EXPECT_EQ(query->hits()[hitting].status, HitStatus::hit);
        EXPECT_EQ(query->hits()[1 - hitting].status, HitStatus::miss);
      }
    }
  }
};

TEST_F(DeepestTrees, OfTrianglesAreSearchedCompletely) {
  TriangleMesh mesh;
  for (std::uint32_t level = 0; level < levels; ++level) {
    const glm::vec3 c = center(level);
    const glm::vec3 reach = 3.0f - 2.0f * c;
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.insert(mesh.positions_m.end(), {c - reach, c + reach * glm::vec3(1.0f, -1.0f, 1.0f),
                                                     c + reach * glm::vec3(0.0f, 1.0f, 0.0f)});
    // More than the children of a node hold.
    mesh.triangles.insert(mesh.triangles.end(), 40, {first, first + 1, first + 2});
  }
  create(row_of(add(mesh)));
  expect_complete_search();
}

TEST_F(DeepestTrees, OfEntitiesAreSearchedCompletely) {
  const GeometryId sheet = add({{{-1, -1, -1}, {1, -1, 1}, {0, 1, 0}}, {{0, 1, 2}}});
  std::vector<EntityRow> rows;
  for (std::uint32_t level = 0; level < levels; ++level) {
    const glm::vec3 reach = 1.0f - center(level);
    EntityRow row = row_of(sheet, center(level));
    row.scale = glm::dvec3(1.0f + 2.0f * (reach.x + reach.y + reach.z));
    rows.insert(rows.end(), 9, row);
  }
  create(rows);
  expect_complete_search();
}

/// A packet has half the stack of a single ray, which 21 levels of both trees exceed: its rays are retried
/// one by one.
TEST_F(DeepTrees, GiveTheSameHitsInAPacketAndAlone) {
  for (const int levels : {2, 9, 18, 21}) {
    open({});
    fill(levels, 9);
    const auto query = prepare_rays();
    const std::vector<Ray> rays(16, through());
    ASSERT_TRUE(query::are_coherent(rays));
    run_rays(*query, std::span(rays).first(1));
    const RayHit alone = query->hits()[0];
    EXPECT_EQ(alone.status, HitStatus::hit) << levels << " levels";
    EXPECT_EQ(run_rays(*query, rays).status, Status::committed);
    for (const RayHit& hit : query->hits()) {
      EXPECT_EQ(hit.status, HitStatus::hit) << levels << " levels";
      EXPECT_EQ(hit.entity, alone.entity);
      EXPECT_EQ(hit.lambda, alone.lambda);
    }
  }
}

/// One side of triangles counts: that of a body before or behind the deep trees, whose triangles face the
/// other way.
TEST_F(DeepTrees, HideNoHitBeforeOrBehindThem) {
  for (const bool use_subgroup_kernels : {false, true}) {
    for (const double body_z_m : {-3.0, 3.0}) {
      open({}, {.use_subgroup_kernels = use_subgroup_kernels});
      fill(9, 64);
      create(row_of(add(make_box({1.0, 1.0, 1.0})), {0.5, 0.1, body_z_m}));
      for (const Faces faces : {Faces::front, Faces::back}) {
        const auto any =
            prepare(RayQueryOptions{.name = "any", .capacity = 16, .mode = RayMode::any, .faces = faces});
        const std::vector<Ray> rays(16, through());
        for (const std::size_t size : {16u, 1u}) {
          EXPECT_EQ(run_rays(*any, std::span(rays).first(size)).status, Status::committed);
          EXPECT_EQ(std::ranges::count(any->hits(), HitStatus::hit, &RayHit::status),
                    static_cast<std::ptrdiff_t>(size));
        }
      }
    }
  }
}

/// Rays that hit one of all triangles visit each deferred node.
TEST_F(DeepTrees, LoseNoDeferredNode) {
  Random random(9);
  std::vector<Ray> rays;
  for (int i = 0; i < 160; ++i) {
    const glm::vec3 from_m(0.5 + 2.0 * random.normal(), 2.0 * random.normal(), random.one_in(2) ? -5.0 : 5.0);
    rays.push_back(ray_from(from_m, {0.3 * random.normal(), 0.3 * random.normal(), -from_m.z}));
  }
  ASSERT_FALSE(query::are_coherent(rays));
  std::vector<RayHit> hits[2];
  for (const bool use_subgroup_kernels : {false, true}) {
    for (const int turned : {10, 20}) {
      open({}, {.use_subgroup_kernels = use_subgroup_kernels});
      fill(21, 9, turned);
      for (const RayMode mode : {RayMode::closest, RayMode::any}) {
        for (const Faces faces : {Faces::front, Faces::back}) {
          const auto query =
              prepare(RayQueryOptions{.name = "one side", .capacity = 160, .mode = mode, .faces = faces});
          const auto some = trace(*query, rays);
          auto& all = hits[use_subgroup_kernels ? 1 : 0];
          all.insert(all.end(), some.begin(), some.end());
        }
      }
    }
  }
  for (std::size_t i = 0; i < hits[0].size(); ++i)
    ASSERT_TRUE(same_bits(hits[0][i], hits[1][i])) << "answer " << i;
  EXPECT_GT(std::ranges::count(hits[0], HitStatus::hit, &RayHit::status), 300);
  EXPECT_GT(std::ranges::count(hits[0], HitStatus::miss, &RayHit::status), 100);
}

}  // namespace
}  // namespace rtstdb::test
