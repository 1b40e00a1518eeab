// Searches for what is nearest that pass the limits of the device or of the shader: incomplete, never wrong.

#include <algorithm>
#include <cmath>

#include "tests/gpu/dense_meshes.hpp"

namespace rtstdb::test {
namespace {

class NearestLimits : public DatabaseTest {
 protected:
  std::unique_ptr<NearestQuery> prepare(NearestTarget target, std::uint32_t k, bool is_signed = false) {
    auto query = database().prepare(NearestQueryOptions{
        .name = "nearest", .capacity = 64, .target = target, .k = k, .is_signed = is_signed});
    EXPECT_TRUE(query.ok());
    return std::move(query).value();
  }
  Outcome ask(NearestQuery& query, std::span<const glm::vec3> points_m) {
    for (std::size_t i = 0; i < points_m.size(); ++i)
      query.points()[i].point_m = points_m[i];
    return execute([&](Transaction& transaction) {
      transaction.add_query(query, static_cast<std::uint32_t>(points_m.size()));
    });
  }
  static void expect_none(const Outcome& outcome, const NearestAnswer& answer) {
    EXPECT_TRUE(answer.incomplete);
    EXPECT_EQ(outcome.status, Status::truncated);
    EXPECT_TRUE(answer.neighbors.empty());
  }
};

TEST_F(NearestLimits, APileOfTrianglesIsSearchedWholeOrNotAnswered) {
  const EntityId aside = create(row_of(add(make_box({2.0, 2.0, 2.0})), {1000.0, 0.0, 0.0}));
  const std::unique_ptr<NearestQuery> queries[] = {prepare(NearestTarget::surface, 1),
                                                   prepare(NearestTarget::triangle, 32),
                                                   prepare(NearestTarget::surface, 2)};
  std::size_t whole = 0;
  std::size_t cut_short = 0;
  EntityId before;
  for (const std::uint32_t count : {100u, 1'000u, 5'000u, 20'000u, 100'000u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(pile(count)), {0.0, 0.0, 5.0}));
    for (const auto& query : queries) {
      const glm::vec3 points_m[] = {{0.0f, 0.0f, 0.0f}, {1000.0f, 0.0f, 3.0f}};
      query->points()[1].radius_m = 10.0f;
      const Outcome outcome = ask(*query, points_m);
      const auto answers = query->answers();
      ASSERT_FALSE(answers[1].incomplete) << "a short search beside a long one";
      EXPECT_EQ(answers[1].neighbors[0].entity, aside);
      EXPECT_EQ(answers[1].neighbors[0].distance_m, 2.0f);
      if (answers[0].incomplete) {
        ++cut_short;
        expect_none(outcome, answers[0]);
        continue;
      }
      ++whole;
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
  EXPECT_GE(whole, 6u);
  EXPECT_GE(cut_short, 3u) << "no search came to the limit";
}

TEST_F(NearestLimits, ASignIsCountedWholeOrNotAnswered) {
  const auto query = prepare(NearestTarget::surface, 1, true);
  bool whole = false;
  bool cut_short = false;
  EntityId before;
  for (const std::uint32_t storeys : {100u, 1'000u, 5'000u, 60'000u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(tower(storeys))));
    const glm::vec3 points_m[] = {{0.01f, 0.02f, 0.0025f}, {0.01f, 0.02f, -2.0f}, {3.0f, 0.0f, -0.25f}};
    const Outcome outcome = ask(*query, points_m);
    const auto answers = query->answers();
    ASSERT_FALSE(answers[2].incomplete) << "a column beside the tower";
    EXPECT_GT(answers[2].neighbors[0].distance_m, 0.0f);
    for (int i = 0; i < 2; ++i) {
      if (answers[i].incomplete) {
        cut_short = true;
        expect_none(outcome, answers[i]);
        continue;
      }
      whole = true;
      EXPECT_TRUE(answers[i].neighbors[0].has_sign);
      EXPECT_FLOAT_EQ(answers[i].neighbors[0].distance_m, i == 0 ? -0.0025f : 2.0f) << storeys;
    }
  }
  EXPECT_TRUE(whole);
  EXPECT_TRUE(cut_short) << "no column came to the limit";
}

/// Points within a shell of many triangles: whether one is answered must not depend on its neighbours in the
/// batch, with which it shares an allowance of rounds on lavapipe.
TEST_F(NearestLimits, ABatchOfLongSearchesIsAnsweredAsEachAlone) {
  Random random(23);
  std::vector<glm::vec3> points_m;
  points_m.reserve(64);
  for (int i = 0; i < 64; ++i)
    points_m.emplace_back(random.magnitude(1e-7, 0.3) * random.direction());
  const auto query = prepare(NearestTarget::triangle, 4);
  std::size_t whole = 0;
  std::size_t cut_short = 0;
  EntityId before;
  for (const std::uint32_t subdivisions : {4u, 7u}) {
    if (before.valid()) remove(before, {});
    before = create(row_of(add(make_sphere(1.0, subdivisions))));
    ask(*query, points_m);
    std::vector<std::vector<Neighbor>> together;
    std::vector<bool> incomplete;
    for (const NearestAnswer& answer : query->answers()) {
      together.emplace_back(answer.neighbors.begin(), answer.neighbors.end());
      incomplete.push_back(answer.incomplete);
    }
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      ask(*query, std::span(points_m).subspan(i, 1));
      const NearestAnswer& alone = query->answers()[0];
      ASSERT_EQ(alone.incomplete, incomplete[i]) << "point " << i;
      EXPECT_TRUE(
          std::ranges::equal(alone.neighbors, together[i], {}, &Neighbor::triangle, &Neighbor::triangle));
      EXPECT_TRUE(
          std::ranges::equal(alone.neighbors, together[i], {}, &Neighbor::distance_m, &Neighbor::distance_m));
      (alone.incomplete ? cut_short : whole) += 1;
    }
  }
  EXPECT_GT(whole, 64u);
  EXPECT_GT(cut_short, 0u) << "no search came to the limit";
}

TEST_F(NearestLimits, AHeapOfEntitiesIsSearchedWholeOrNotAnswered) {
  open({.max_entities = 60'000});
  const GeometryId sphere = add(make_sphere(1.0, 1));
  std::vector<EntityId> all;
  bool cut_short = false;
  for (const std::uint32_t count : {200u, 3'000u, 59'000u}) {
    const auto ids = create(std::vector<EntityRow>(count - all.size(), row_of(sphere, {0.0, 0.0, 9.0})));
    all.insert(all.end(), ids.begin(), ids.end());
    for (const NearestTarget target :
         {NearestTarget::center, NearestTarget::bounds, NearestTarget::surface}) {
      const auto query = prepare(target, 8);
      const glm::vec3 point_m(0.1f, 0.2f, 0.0f);
      const Outcome outcome = ask(*query, std::span(&point_m, 1));
      const NearestAnswer& answer = query->answers()[0];
      if (answer.incomplete) {
        cut_short = true;
        expect_none(outcome, answer);
        continue;
      }
      EXPECT_TRUE(std::ranges::equal(answer.neighbors, std::span(all).first(8), {}, &Neighbor::entity));
    }
  }
  EXPECT_TRUE(cut_short) << "no search came to the limit";
}

/// Heaps one behind the other, each nearer than the one before and a little smaller: every level of the tree
/// holds one heap in seven leaves, which wait, and all that is left.
TEST_F(NearestLimits, AStackThatIsFullIsNoAnswer) {
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
  ask(*query, points_m);
  EXPECT_TRUE(query->answers()[0].incomplete);
  const NearestAnswer& from_before = query->answers()[1];
  ASSERT_EQ(from_before.neighbors.size(), 1u);
  EXPECT_EQ(from_before.neighbors[0].entity, entity);
  EXPECT_EQ(from_before.neighbors[0].triangle, 0u);
}

}  // namespace
}  // namespace rtstdb::test
