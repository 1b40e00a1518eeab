// Searches that take more than a dispatch gives: of rays whole, in as many dispatches as they need; of
// regions incomplete, never wrong.

#include <algorithm>
#include <cmath>

#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/dense_meshes.hpp"

namespace rtstdb::test {
namespace {

class SearchLimits : public DatabaseTest {
 protected:
  Outcome ask(RayQuery& query, std::span<const Ray> rays) {
    std::ranges::copy(rays, query.rays().begin());
    return execute([&](Transaction& transaction) {
      transaction.add_query(query, static_cast<std::uint32_t>(rays.size()));
    });
  }
};

/// Each ray makes a round for each triangle at least, and a dispatch has 65,535.
TEST_F(SearchLimits, APileOfTrianglesIsSearchedWhole) {
  const auto query = prepare_rays();
  const auto any = prepare_rays(RayMode::any);
  EntityId before;
  for (const std::uint32_t count : {100u, 1'000u, 10'000u, 20'000u, 100'000u, 300'000u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(pile(count)), {0.0, 0.0, 5.0}));
    const Ray through[] = {ray_from({}, {0, 0, 1}), ray_from({}, {0, 0, -1})};
    EXPECT_EQ(ask(*query, through).status, Status::committed) << count << " triangles";
    const RayHit& hit = query->hits()[0];
    EXPECT_EQ(hit.status, HitStatus::hit);
    EXPECT_EQ(hit.triangle, 0u) << "the lowest of all that tie";
    EXPECT_EQ(hit.lambda, 5.0f);
    EXPECT_EQ(query->hits()[1].status, HitStatus::miss)
        << "a ray that meets nothing, beside one that meets all";
    EXPECT_EQ(ask(*any, through).status, Status::committed);
    EXPECT_EQ(any->hits()[0].status, HitStatus::hit);
    EXPECT_EQ(any->hits()[1].status, HitStatus::miss);
  }
}

/// More than are asked again at a time, the last ones not as many as the others.
TEST_F(SearchLimits, ManyRaysThroughPilesAreAnswered) {
  const EntityId near = create(row_of(add(pile(70'000)), {0.0, 0.0, 5.0}));
  const EntityId far = create(row_of(add(pile(80'000)), {0.0, 0.0, 9.0}));
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

/// How the lanes of a subgroup go about their rays: as one packet, each its own, each its own but some
/// entities of others, or each its own on a device where lanes do not work together.
enum class Lanes : std::uint8_t { packet, apart, work_sharing, alone };

/// On lavapipe eight neighbours in the batch share one allowance of rounds. What a ray is answered must not
/// depend on them, and none may be taken for a miss when the allowance ends.
class LongSearches : public SearchLimits, public testing::WithParamInterface<Lanes> {
 protected:
  /// Side by side they are traced together.
  static std::vector<Ray> rays(Random& random, bool side_by_side) {
    std::vector<Ray> rays;
    for (int i = 0; i < 64; ++i) {
      const glm::vec3 from_m(random.uniform(-3, 3), random.uniform(-3, 3), -20.0);
      const glm::vec3 aside(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 1.0);
      rays.push_back(side_by_side ? ray_from({0.0f, 0.0f, -20.0f}, glm::vec3(0.2f, 0.2f, 1.0f) * aside)
                                  : ray_from(from_m, aside));
    }
    EXPECT_EQ(query::are_coherent(rays), side_by_side);
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

TEST_P(LongSearches, AreAnsweredInABatchAsEachAlone) {
  Random random(21);
  open({}, {.use_subgroup_kernels = GetParam() != Lanes::alone});
  const EntityId wall = create(row_of(add(make_box({50.0, 50.0, 1.0})), {0.0, 0.0, 20.5}));
  // Few entities are searched by a lane alone.
  if (GetParam() == Lanes::work_sharing)
    create(std::vector<EntityRow>(30, row_of(add(make_box({1.0, 1.0, 1.0})), {0.0, 500.0, 0.0})));
  const std::vector<Ray> rays = LongSearches::rays(random, GetParam() == Lanes::packet);
  const auto query = prepare_rays();
  const auto any = prepare_rays(RayMode::any);
  EntityId before;
  for (const std::uint32_t count : {100'000u, 800'000u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(thicket(random, count))));
    EXPECT_EQ(ask(*query, rays).status, Status::committed) << count << " lines";
    const std::vector<RayHit> together(query->hits().begin(), query->hits().end());
    EXPECT_EQ(ask(*any, rays).status, Status::committed) << count << " lines";
    EXPECT_EQ(std::ranges::count(any->hits(), HitStatus::hit, &RayHit::status), std::ssize(rays));
    for (std::size_t i = 0; i < rays.size(); ++i) {
      EXPECT_EQ(together[i].entity, wall) << "ray " << i << " of " << count << " lines";
      EXPECT_FLOAT_EQ(together[i].lambda, 40.0f);
      if (i % 7 != 0) continue;
      ask(*query, std::span(rays).subspan(i, 1));
      EXPECT_EQ(query->hits()[0].entity, wall) << "ray " << i << " of " << count << " lines, alone";
      EXPECT_EQ(query->hits()[0].lambda, together[i].lambda);
      EXPECT_EQ(query->hits()[0].triangle, together[i].triangle);
      ask(*any, std::span(rays).subspan(i, 1));
      EXPECT_EQ(any->hits()[0].status, HitStatus::hit) << "ray " << i << " of " << count << " lines, alone";
    }
  }
}

/// A packet goes through children in the order that suits its first ray, a ray alone in that which suits
/// itself: which of two piles and a wall comes first is not the same for all of them.
TEST_F(SearchLimits, WhicheverRayLeads) {
  for (const RayMode mode : {RayMode::closest, RayMode::any}) {
    open({});
    const GeometryId heap = add(pile(100'000));
    for (const glm::dvec3 place_m :
         {glm::dvec3(-0.243483, 1.297308, 9.640508), glm::dvec3(0.756596, -1.575662, -2.423214)}) {
      EntityRow row = row_of(heap, place_m);
      row.scale = glm::dvec3(10.0);
      create(row);
    }
    create(row_of(add(make_box({40.0, 40.0, 0.2})), {-2.434557, 2.457633, -5.050840}));
    auto made = database().prepare(
        RayQueryOptions{.name = "fronts", .capacity = 64, .mode = mode, .faces = Faces::front});
    ASSERT_TRUE(made.ok());
    RayQuery& query = *made.value();
    const Ray other = ray_from({0, 0, -20}, {0.004f, 0.004f, 1.0f});
    std::vector<Ray> rays(8, other);
    const auto status_of_it = [&](std::size_t place, std::size_t count) {
      std::ranges::fill(rays, other);
      rays[place] = ray_from({0, 0, -20}, {-0.005f, -0.005f, 1.0f});
      EXPECT_EQ(ask(query, std::span(rays).first(count)).status, Status::committed);
      return query.hits()[place].status;
    };
    EXPECT_EQ(status_of_it(0, 1), HitStatus::hit);
    EXPECT_EQ(status_of_it(0, 8), HitStatus::hit);
    EXPECT_EQ(status_of_it(7, 8), HitStatus::hit);
  }
}

/// A ray by itself looks among what is far away first, where any hit will do, and one in a packet among what
/// is near.
TEST_P(LongSearches, FindAnyHitBeforeAndBehindWhatIsCostly) {
  const TriangleMesh wall = make_box({50.0, 50.0, 0.1});
  for (const float wall_z_m : {-15.0f, 15.0f}) {
    for (const bool in_one_mesh : {false, true}) {
      Random random(21);
      std::vector<Ray> rays = LongSearches::rays(random, GetParam() == Lanes::packet);
      open({}, {.use_subgroup_kernels = GetParam() != Lanes::alone});
      TriangleMesh costly = thicket(random, 800'000);
      if (in_one_mesh)
        join(costly, wall, {0.0f, 0.0f, wall_z_m});
      else
        create(row_of(add(wall), {0.0, 0.0, wall_z_m}));
      create(row_of(add(costly)));
      if (GetParam() == Lanes::work_sharing)
        create(std::vector<EntityRow>(30, row_of(add(make_box({1.0, 1.0, 1.0})), {0.0, 500.0, 0.0})));
      const auto any = prepare_rays(RayMode::any);
      const auto expect_hits = [&](std::span<const Ray> asked) {
        EXPECT_EQ(ask(*any, asked).status, Status::committed);
        EXPECT_EQ(std::ranges::count(any->hits(), HitStatus::hit, &RayHit::status), std::ssize(asked))
            << "of " << asked.size() << " rays; wall at " << wall_z_m
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

INSTANTIATE_TEST_SUITE_P(Neighbours, LongSearches,
                         testing::Values(Lanes::packet, Lanes::apart, Lanes::work_sharing, Lanes::alone),
                         [](const auto& one) {
                           switch (one.param) {
                             case Lanes::packet:
                               return "SideBySide";
                             case Lanes::apart:
                               return "Apart";
                             case Lanes::work_sharing:
                               return "ForOneAnother";
                             case Lanes::alone:
                               break;
                           }
                           return "OfLoneLanes";
                         });

/// Lanes may be in the wall and in the pile behind it at once, for the same ray. The pile alone takes many
/// dispatches.
TEST_F(SearchLimits, WhatLiesBehindAHitIsNotSearched) {
  const EntityId wall = create(row_of(add(make_box({4.0, 4.0, 0.1})), {0.0, 0.0, 2.0}));
  create(row_of(add(pile(100'000)), {0.0, 0.0, 5.0}));
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
    const Outcome outcome = ask(*query, std::span(rays).first(size));
    EXPECT_EQ(outcome.status, Status::committed) << size << " rays";
    with_wall = outcome.actual_cost;
    EXPECT_EQ(ask(*any, std::span(rays).first(size)).status, Status::committed) << size << " rays";
    for (std::size_t i = 0; i < size; ++i) {
      EXPECT_EQ(query->hits()[i].entity, wall) << "ray " << i << " of " << size;
      EXPECT_EQ(any->hits()[i].status, HitStatus::hit) << "ray " << i << " of " << size;
    }
  }
  remove(wall, {});
  EXPECT_GT(ask(*query, rays).actual_cost, 10 * with_wall);
}

TEST_F(SearchLimits, AHeapOfEntitiesIsSearchedWhole) {
  const GeometryId sphere = add(make_sphere(1.0, 1));
  std::vector<EntityId> all;
  for (const std::uint32_t count : {200u, 4096u}) {
    const std::vector<EntityRow> rows(count - all.size(), row_of(sphere, {0.0, 0.0, 9.0}));
    const auto ids = create(rows);
    all.insert(all.end(), ids.begin(), ids.end());
    const RayHit hit = trace(ray_from({0.1f, 0.2f, 0.0f}, {0, 0, 1}));
    ASSERT_EQ(hit.status, HitStatus::hit) << count << " entities";
    EXPECT_EQ(hit.entity, all[0]);
  }
  EXPECT_EQ(trace(ray_from({5.0f, 0.0f, 0.0f}, {0, 0, 1})).status, HitStatus::miss);
}

TEST_F(SearchLimits, ARegionFindsAllOrSaysThatItDidNot) {
  open({.max_entities = 40'000});
  const GeometryId box = add(make_box({1.0, 1.0, 1.0}));
  auto query = database().prepare(RegionQueryOptions{.name = "all", .capacity = 70, .ids_per_region = 64});
  ASSERT_TRUE(query.ok());
  for (Region& region : query.value()->regions())
    region.half_extent_m = glm::vec3(1e4f);
  // A small one among the large.
  query.value()->regions()[33].half_extent_m = glm::vec3(0.1f);
  std::vector<EntityId> all;
  bool cut_short = false;
  for (const std::uint32_t count : {1'000u, 4'000u, 38'000u}) {
    std::vector<EntityRow> rows;
    for (auto i = static_cast<std::uint32_t>(all.size()); i < count; ++i)
      rows.push_back(row_of(box, 2.0 * glm::dvec3(glm::uvec3(i % 200, i / 200, 0))));
    const auto ids = create(rows);
    all.insert(all.end(), ids.begin(), ids.end());
    const Outcome outcome =
        execute([&](Transaction& transaction) { transaction.add_query(*query.value(), 70); });
    EXPECT_EQ(outcome.status, Status::truncated);
    EXPECT_EQ(query.value()->answer_info().missing,
              std::ranges::count_if(query.value()->answers(), &RegionAnswer::incomplete));
    for (std::uint32_t i = 0; i < 70; ++i) {
      const RegionAnswer& answer = query.value()->answers()[i];
      if (i == 33) {
        EXPECT_FALSE(answer.incomplete);
        EXPECT_EQ(answer.found, 1u);
        continue;
      }
      cut_short = cut_short || answer.incomplete;
      if (count <= 4'000) {
        EXPECT_FALSE(answer.incomplete) << count << " entities";
      }
      EXPECT_EQ(answer.found, count) << "is counted, even where the lowest can not be told in time";
      EXPECT_TRUE(answer.overflow);
      if (answer.incomplete) continue;
      EXPECT_TRUE(std::ranges::equal(answer.entities, std::span(all).first(64)));
    }
  }
  EXPECT_TRUE(cut_short) << "no search came to the limit";
}

/// Sizes and places such that each level of a tree holds one more heap and all that is left: heaps of bodies,
/// and each body heaps of triangles. A ray has to remember something at each level of both trees.
class DeepTrees : public SearchLimits {
 protected:
  /// `turned`: at which level one triangle of one body more shows its other side; none where it is negative.
  void fill(int levels, std::size_t heap, int turned = -1) {
    TriangleMesh mesh;
    for (int level = 0; level < levels; ++level) {
      const auto x = static_cast<float>(1.0 - std::exp2(-level));
      const float size = 20.0f - 0.8f * static_cast<float>(level);
      const float height = 0.1f + 0.005f * static_cast<float>(level);
      const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
      mesh.positions_m.insert(mesh.positions_m.end(),
                              {{x - size, -size, -height}, {x + size, -size, height}, {x, size, 0.0f}});
      mesh.triangles.insert(mesh.triangles.end(), heap, {first, first + 1, first + 2});
    }
    const GeometryId heaps = add(mesh);
    std::vector<EntityRow> rows;
    for (int level = 0; level < levels; ++level) {
      EntityRow row = row_of(heaps, {1.0 - std::exp2(-level), 0.0, 0.0});
      row.scale = glm::dvec3(1.0 - 0.02 * level);
      rows.insert(rows.end(), heap, row);
    }
    if (turned >= 0) {
      const auto first = static_cast<std::uint32_t>(3 * turned);
      mesh.triangles.emplace_back(first, first + 2, first + 1);
      rows[heap * static_cast<std::size_t>(turned + 1) - 1].geometry = add(mesh);
    }
    create(rows);
  }
  static Ray through() { return ray_from({0.5f, 0.1f, -5.0f}, {0, 0, 1}); }
};

TEST_F(DeepTrees, AreSearchedWhole) {
  fill(21, 64);
  const auto query = prepare_rays();
  const Ray rays[] = {through(), ray_from({500.0f, 0.1f, -5.0f}, {0, 0, 1})};
  EXPECT_EQ(ask(*query, rays).status, Status::committed);
  EXPECT_EQ(query->hits()[0].status, HitStatus::hit);
  EXPECT_EQ(query->hits()[1].status, HitStatus::miss);
}

/// Centres each of which differs from all behind it in one bit of its code, as many as the code has bits; and
/// around each what holds all that are behind it, so that it is at that that a node is opened.
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
  /// From both sides, of which one sees nothing but has to look at all.
  void expect_all_is_looked_at() {
    for (const RayMode mode : {RayMode::closest, RayMode::any}) {
      for (const Faces faces : {Faces::front, Faces::back}) {
        const auto query = database().prepare(
            RayQueryOptions{.name = "one side", .capacity = 2, .mode = mode, .faces = faces});
        ASSERT_TRUE(query.ok());
        const Ray rays[] = {ray_from({0.9f, 0.8f, -9.0f}, {0, 0, 1}),
                            ray_from({0.9f, 0.8f, 9.0f}, {0, 0, -1})};
        EXPECT_EQ(ask(*query.value(), rays).status, Status::committed);
        const std::size_t sees = faces == Faces::back ? 0 : 1;
        EXPECT_EQ(query.value()->hits()[sees].status, HitStatus::hit);
        EXPECT_EQ(query.value()->hits()[1 - sees].status, HitStatus::miss);
      }
    }
  }
};

TEST_F(DeepestTrees, OfTriangles) {
  TriangleMesh mesh;
  for (std::uint32_t level = 0; level < levels; ++level) {
    const glm::vec3 c = center(level);
    const glm::vec3 reach = 3.0f - 2.0f * c;
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.insert(mesh.positions_m.end(), {c - reach, c + reach * glm::vec3(1.0f, -1.0f, 1.0f),
                                                     c + reach * glm::vec3(0.0f, 1.0f, 0.0f)});
    // More than the children of a node take in.
    mesh.triangles.insert(mesh.triangles.end(), 40, {first, first + 1, first + 2});
  }
  create(row_of(add(mesh)));
  expect_all_is_looked_at();
}

TEST_F(DeepestTrees, OfEntities) {
  const GeometryId sheet = add({{{-1, -1, -1}, {1, -1, 1}, {0, 1, 0}}, {{0, 1, 2}}});
  std::vector<EntityRow> rows;
  for (std::uint32_t level = 0; level < levels; ++level) {
    const glm::vec3 left = 1.0f - center(level);
    EntityRow row = row_of(sheet, center(level));
    row.scale = glm::dvec3(1.0f + 2.0f * (left.x + left.y + left.z));
    rows.insert(rows.end(), 9, row);
  }
  create(rows);
  expect_all_is_looked_at();
}

/// Rays that are traced together have half the stack, which 21 levels of both trees pass: they are asked
/// again one by one.
TEST_F(DeepTrees, NeighboursAreAnsweredAsEachAlone) {
  for (const int levels : {2, 9, 18, 21}) {
    open({});
    fill(levels, 9);
    const auto query = prepare_rays();
    const std::vector<Ray> rays(16, through());
    ASSERT_TRUE(query::are_coherent(rays));
    ask(*query, std::span(rays).first(1));
    const RayHit alone = query->hits()[0];
    EXPECT_EQ(alone.status, HitStatus::hit) << levels << " levels";
    EXPECT_EQ(ask(*query, rays).status, Status::committed);
    for (const RayHit& hit : query->hits()) {
      EXPECT_EQ(hit.status, HitStatus::hit) << levels << " levels";
      EXPECT_EQ(hit.entity, alone.entity);
      EXPECT_EQ(hit.lambda, alone.lambda);
    }
  }
}

/// A body before or behind them shows the one side that is asked for, the heaps the other.
TEST_F(DeepTrees, AnyHitBeforeAndBehindThemIsFound) {
  for (const bool use_subgroup_kernels : {false, true}) {
    for (const double body_z_m : {-3.0, 3.0}) {
      open({}, {.use_subgroup_kernels = use_subgroup_kernels});
      fill(9, 64);
      create(row_of(add(make_box({1.0, 1.0, 1.0})), {0.5, 0.1, body_z_m}));
      for (const Faces faces : {Faces::front, Faces::back}) {
        const auto any = database().prepare(
            RayQueryOptions{.name = "any", .capacity = 16, .mode = RayMode::any, .faces = faces});
        ASSERT_TRUE(any.ok());
        const std::vector<Ray> beside(16, through());
        for (const std::size_t size : {16u, 1u}) {
          EXPECT_EQ(ask(*any.value(), std::span(beside).first(size)).status, Status::committed);
          EXPECT_EQ(std::ranges::count(any.value()->hits(), HitStatus::hit, &RayHit::status),
                    static_cast<std::ptrdiff_t>(size));
        }
      }
    }
  }
}

/// Rays that pass by all triangles but one, from either side, have to come back to whatever they have put
/// aside.
TEST_F(DeepTrees, WhatWasPutAsideIsComeBackTo) {
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
          auto query = database().prepare(
              RayQueryOptions{.name = "one side", .capacity = 160, .mode = mode, .faces = faces});
          ASSERT_TRUE(query.ok());
          const auto some = trace(*query.value(), rays);
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
