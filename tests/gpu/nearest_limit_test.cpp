// Nearest queries whose searches exceed the limits of the kernel: the answers are incomplete, never wrong.

#include <algorithm>
#include <cmath>

#include "tests/gpu/dense_meshes.hpp"

namespace rtstdb::test {
namespace {

class NearestLimits : public DatabaseTest {
 protected:
  std::unique_ptr<NearestQuery> prepare(NearestTarget target, std::uint32_t k, bool is_signed = false) {
    return DatabaseTest::prepare(NearestQueryOptions{
        .name = "nearest", .capacity = 64, .target = target, .k = k, .is_signed = is_signed});
  }
  Outcome run_points(NearestQuery& query, std::span<const glm::vec3> points_m) {
    for (std::size_t i = 0; i < points_m.size(); ++i)
      query.points()[i].point_m = points_m[i];
    return run(query, points_m.size());
  }
  static void expect_incomplete(const Outcome& outcome, const NearestAnswer& answer) {
    EXPECT_TRUE(answer.incomplete);
    EXPECT_EQ(outcome.status, Status::truncated);
    EXPECT_TRUE(answer.neighbors.empty());
  }
};

TEST_F(NearestLimits, ManyEqualTrianglesAreSearchedCompletelyOrIncomplete) {
  const EntityId distant = create(row_of(add(make_box({2.0, 2.0, 2.0})), {1000.0, 0.0, 0.0}));
  const std::unique_ptr<NearestQuery> queries[] = {prepare(NearestTarget::surface, 1),
                                                   prepare(NearestTarget::triangle, 32),
                                                   prepare(NearestTarget::surface, 2)};
  std::size_t complete = 0;
  std::size_t incomplete_count = 0;
  EntityId before;
  for (const std::uint32_t count : {100u, 1'000u, 5'000u, 20'000u, 100'000u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(repeated_triangle(count)), {0.0, 0.0, 5.0}));
    for (const auto& query : queries) {
      const glm::vec3 points_m[] = {{0.0f, 0.0f, 0.0f}, {1000.0f, 0.0f, 3.0f}};
      query->points()[1].radius_m = 10.0f;
      const Outcome outcome = run_points(*query, points_m);
      const auto answers = query->answers();
      ASSERT_FALSE(answers[1].incomplete) << "a short search beside a long one";
      EXPECT_EQ(answers[1].neighbors[0].entity, distant);
      EXPECT_EQ(answers[1].neighbors[0].distance_m, 2.0f);
      if (answers[0].incomplete) {
        ++incomplete_count;
        expect_incomplete(outcome, answers[0]);
        continue;
      }
      ++complete;
      EXPECT_EQ(outcome.status, Status::committed);
      EXPECT_EQ(answers[0].neighbors[0].entity, before);
      EXPECT_EQ(answers[0].neighbors[0].triangle, 0u);
      EXPECT_EQ(answers[0].neighbors[0].distance_m, 5.0f);
      if (query == queries[1]) {
        ASSERT_EQ(answers[0].neighbors.size(), 32u);
        EXPECT_EQ(answers[0].neighbors[31].triangle, 31u);
      }
    }
  }
  EXPECT_GE(complete, 6u);
  EXPECT_GE(incomplete_count, 3u) << "no search exceeds the limit";
}

TEST_F(NearestLimits, SignsAreCountedCompletelyOrIncomplete) {
  const auto query = prepare(NearestTarget::surface, 1, true);
  bool complete = false;
  bool some_incomplete = false;
  EntityId before;
  for (const std::uint32_t prisms : {100u, 1'000u, 5'000u, 60'000u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(stacked_prisms(prisms))));
    const glm::vec3 points_m[] = {{0.01f, 0.02f, 0.0025f}, {0.01f, 0.02f, -2.0f}, {3.0f, 0.0f, -0.25f}};
    const Outcome outcome = run_points(*query, points_m);
    const auto answers = query->answers();
    ASSERT_FALSE(answers[2].incomplete) << "a point beside the prisms";
    EXPECT_GT(answers[2].neighbors[0].distance_m, 0.0f);
    for (int i = 0; i < 2; ++i) {
      if (answers[i].incomplete) {
        some_incomplete = true;
        expect_incomplete(outcome, answers[i]);
        continue;
      }
      complete = true;
      EXPECT_TRUE(answers[i].neighbors[0].has_sign);
      EXPECT_FLOAT_EQ(answers[i].neighbors[0].distance_m, i == 0 ? -0.0025f : 2.0f) << prisms;
    }
  }
  EXPECT_TRUE(complete);
  EXPECT_TRUE(some_incomplete) << "no count exceeds the limit";
}

/// On lavapipe eight neighbouring points of a batch share a limit of rounds. Whether a point is complete must
/// not depend on the others.
TEST_F(NearestLimits, LongSearchesDoNotDependOnTheBatch) {
  Random random(23);
  std::vector<glm::vec3> points_m;
  points_m.reserve(64);
  for (int i = 0; i < 64; ++i)
    points_m.emplace_back(random.magnitude(1e-7, 0.3) * random.direction());
  const auto query = prepare(NearestTarget::triangle, 4);
  std::size_t complete = 0;
  std::size_t incomplete_count = 0;
  EntityId before;
  for (const std::uint32_t subdivisions : {4u, 7u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(make_sphere(1.0, subdivisions))));
    run_points(*query, points_m);
    std::vector<std::vector<Neighbor>> in_batch;
    std::vector<bool> incomplete;
    for (const NearestAnswer& answer : query->answers()) {
      in_batch.emplace_back(answer.neighbors.begin(), answer.neighbors.end());
      incomplete.push_back(answer.incomplete);
    }
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      run_points(*query, std::span(points_m).subspan(i, 1));
      const NearestAnswer& alone = query->answers()[0];
      ASSERT_EQ(alone.incomplete, incomplete[i]) << "point " << i;
      EXPECT_TRUE(
          std::ranges::equal(alone.neighbors, in_batch[i], {}, &Neighbor::triangle, &Neighbor::triangle));
      EXPECT_TRUE(
          std::ranges::equal(alone.neighbors, in_batch[i], {}, &Neighbor::distance_m, &Neighbor::distance_m));
      (alone.incomplete ? incomplete_count : complete) += 1;
    }
  }
  EXPECT_GT(complete, 64u);
  EXPECT_GT(incomplete_count, 0u) << "no search exceeds the limit";
}

/// Each level of the tree has seven leaves of equal triangles, which the search defers, and one node with all
/// smaller and nearer triangles: the stack overflows.
TEST_F(NearestLimits, AStackOverflowIsIncomplete) {
  TriangleMesh mesh;
  constexpr int levels = 21;
  for (int level = 0; level < levels; ++level) {
    const auto x = static_cast<float>(1.0 - std::exp2(-level));
    const float size = 20.0f - 0.8f * static_cast<float>(level);
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.insert(mesh.positions_m.end(), {{x, -size, -size}, {x, size, -size}, {x, 0.0f, size}});
    mesh.triangles.insert(mesh.triangles.end(), 28, {first, first + 1, first + 2});
  }
  const EntityId entity = create(row_of(add(mesh)));
  const auto query = prepare(NearestTarget::triangle, 1);
  const glm::vec3 points_m[] = {{5.0f, 0.0f, 0.0f}, {-5.0f, 0.0f, 0.0f}};
  run_points(*query, points_m);
  EXPECT_TRUE(query->answers()[0].incomplete);
  const NearestAnswer& from_front = query->answers()[1];
  ASSERT_EQ(from_front.neighbors.size(), 1u);
  EXPECT_EQ(from_front.neighbors[0].entity, entity);
  EXPECT_EQ(from_front.neighbors[0].triangle, 0u);
}

}  // namespace
}  // namespace rtstdb::test
