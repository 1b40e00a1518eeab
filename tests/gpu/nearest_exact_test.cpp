// What is nearest where no rounding may decide, and against closed forms.

#include <algorithm>
#include <cmath>
#include <limits>

#include <rtstdb/limits.hpp>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

constexpr float infinity_f = std::numeric_limits<float>::infinity();

Nearest near(const glm::vec3& point_m, float radius_m = infinity_f, WorldTime t = {}) {
  Nearest point;
  point.point_m = point_m;
  point.radius_m = radius_m;
  point.t = t;
  return point;
}

class NearestTest : public DatabaseTest {
 protected:
  std::unique_ptr<NearestQuery> prepare(NearestTarget target, std::uint32_t k = 1, bool is_signed = false,
                                        std::uint32_t capacity = 4096) {
    auto query = database().prepare(NearestQueryOptions{
        .name = "nearest", .capacity = capacity, .target = target, .k = k, .is_signed = is_signed});
    EXPECT_TRUE(query.ok());
    return std::move(query).value();
  }
  std::span<const NearestAnswer> ask(NearestQuery& query, std::span<const Nearest> points) {
    std::ranges::copy(points, query.points().begin());
    const Outcome outcome = execute([&](Transaction& transaction) {
      transaction.add_query(query, static_cast<std::uint32_t>(points.size()));
    });
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    EXPECT_EQ(query.answers().size(), points.size());
    return query.answers();
  }
  std::vector<Neighbor> ask(NearestQuery& query, const Nearest& point) {
    const auto neighbors = ask(query, std::span(&point, 1))[0].neighbors;
    return {neighbors.begin(), neighbors.end()};
  }
  Random random_{91};
};

void expect_point(const glm::vec3& point, const glm::vec3& wanted, float tolerance) {
  EXPECT_LE(glm::length(point - wanted), tolerance)
      << "(" << point.x << ", " << point.y << ", " << point.z << ") instead of (" << wanted.x << ", "
      << wanted.y << ", " << wanted.z << ")";
}

/// Distance to the faces of a box about the origin, negative inside.
double box_distance_m(const glm::dvec3& p, const glm::dvec3& half) {
  const glm::dvec3 beyond = glm::abs(p) - half;
  const double deepest = std::max({beyond.x, beyond.y, beyond.z});
  return deepest <= 0.0 ? deepest : glm::length(glm::max(beyond, glm::dvec3(0.0)));
}

using NearestForms = NearestTest;

/// Moving, turning and stretched, to every target.
TEST_F(NearestForms, OfABoxAtEveryInstant) {
  EntityRow row = row_of(add(make_box({2.0, 4.0, 6.0})), {5.0, -3.0, 1.0});
  row.scale = {0.5, 3.0, 1.25};
  row.motion.q_world = random_.orientation();
  row.motion.v_world_mps = {20.0, -10.0, 3.0};
  row.motion.w_world_radps = {3.0, 9.0, -4.0};
  create(row);
  const glm::dvec3 half(0.5, 6.0, 3.75);
  std::vector<Nearest> points;
  std::vector<glm::dvec3> local;
  for (int i = 0; i < 4000; ++i) {
    local.push_back(half * glm::dvec3(random_.normal(), random_.normal(), random_.normal()));
    const WorldTime t = at_s(random_.uniform(0.0, 1.0));
    const Pose pose = pose_at(row.motion, t);
    points.push_back(near(glm::vec3(pose.p_world_m + pose.q_world * local.back()), infinity_f, t));
  }
  const auto expect = [&](NearestTarget target, bool is_signed, const auto& wanted_m) {
    const auto query = prepare(target, 1, is_signed);
    const auto answers = ask(*query, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_EQ(answers[i].neighbors.size(), 1u);
      const Neighbor& neighbor = answers[i].neighbors[0];
      ASSERT_NEAR(neighbor.distance_m, wanted_m(local[i]), 1e-4) << i;
      ASSERT_NEAR(glm::length(neighbor.p_world_m - points[i].point_m), std::abs(neighbor.distance_m), 1e-4);
    }
  };
  expect(NearestTarget::center, false, [](const glm::dvec3& p) { return glm::length(p); });
  expect(NearestTarget::bounds, false,
         [&](const glm::dvec3& p) { return std::max(0.0, box_distance_m(p, half)); });
  expect(NearestTarget::surface, false,
         [&](const glm::dvec3& p) { return std::abs(box_distance_m(p, half)); });
  expect(NearestTarget::surface, true, [&](const glm::dvec3& p) { return box_distance_m(p, half); });
  expect(NearestTarget::triangle, true, [&](const glm::dvec3& p) { return box_distance_m(p, half); });
}

TEST_F(NearestForms, VelocitiesOfACarriedPointAndOfABodyThatTurns) {
  const GeometryId box = add(make_box({6.0, 2.0, 2.0}));
  EntityRow row = row_of(box);
  row.motion.v_world_mps = {10.0, 0.0, 0.0};
  row.motion.w_world_radps = {0.0, 0.0, 0.5 * 3.14159265358979};
  create(row);
  EntityRow carrier;
  carrier.motion.p_world_m = {0.0, 20.0, 0.0};
  carrier.motion.q_world = glm::angleAxis(0.5 * 3.14159265358979, glm::dvec3(0, 0, 1));
  carrier.motion.v_world_mps = {10.0, 1.0, 0.0};
  // After a second the box stands upright at (10, 0, 0), and the point at (10, 10, 0.5).
  Nearest point = near({-11.0f, 0.0f, 0.5f}, 8.0f, at_s(1.0));
  point.carrier = create(carrier);
  for (const NearestTarget target :
       {NearestTarget::bounds, NearestTarget::surface, NearestTarget::triangle}) {
    const auto query = prepare(target);
    const auto neighbors = ask(*query, point);
    ASSERT_EQ(neighbors.size(), 1u);
    EXPECT_NEAR(neighbors[0].distance_m, 7.0f, 1e-5f);
    expect_point(neighbors[0].p_world_m, {10.0f, 3.0f, 0.5f}, 1e-5f);
    expect_point(neighbors[0].v_relative_mps, {-3.0f * 1.5707963f, -1.0f, 0.0f}, 1e-4f);
  }
}

/// A hollow in the middle, and two bodies in one that overlap.
TEST_F(NearestForms, SignOfHollowAndOverlappingBodies) {
  const auto with = [](TriangleMesh mesh, const TriangleMesh& other, const glm::vec3& offset, bool turned) {
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    for (const glm::vec3& p : other.positions_m)
      mesh.positions_m.push_back(p + offset);
    for (const glm::uvec3& t : other.triangles)
      mesh.triangles.push_back(first + (turned ? glm::uvec3(t.y, t.x, t.z) : t));
    return mesh;
  };
  const TriangleMesh outer = make_box({8.0, 8.0, 8.0});
  TriangleMesh open = outer;
  open.triangles.pop_back();
  const EntityId hollow = create(row_of(add(with(outer, make_box({4.0, 4.0, 4.0}), {}, true))));
  const EntityId overlapping =
      create(row_of(add(with(outer, outer, {3.0f, 0.0f, 0.0f}, false)), {100.0, 0.0, 0.0}));
  const EntityId with_a_hole = create(row_of(add(open), {200.0, 0.0, 0.0}));
  const auto query = prepare(NearestTarget::surface, 1, true);
  const auto expect = [&](const glm::vec3& p, EntityId entity, float distance_m, bool has_sign = true) {
    const auto neighbors = ask(*query, near(p));
    ASSERT_EQ(neighbors.size(), 1u);
    EXPECT_EQ(neighbors[0].entity, entity);
    EXPECT_EQ(neighbors[0].distance_m, distance_m);
    EXPECT_EQ(neighbors[0].has_sign, has_sign);
  };
  expect({0.0f, 0.5f, 0.25f}, hollow, 1.5f);
  expect({0.0f, 2.5f, 0.25f}, hollow, -0.5f);
  expect({0.0f, 5.0f, 0.25f}, hollow, 1.0f);
  expect({98.5f, 0.0f, 3.5f}, overlapping, -0.5f);
  expect({101.5f, 0.0f, 3.5f}, overlapping, -0.5f);  // in both
  expect({105.0f, 0.0f, 3.5f}, overlapping, -0.5f);
  expect({105.0f, 0.0f, 4.5f}, overlapping, 0.5f);
  expect({197.0f, 0.5f, 0.25f}, with_a_hole, 1.0f, false);
}

/// Columns through corners, along edges and within faces: on a whole grid about a box.
TEST_F(NearestForms, SignWhereColumnsMeetEdgesAndCorners) {
  create(row_of(add(make_box({4.0, 4.0, 4.0}))));
  TriangleMesh turned = make_box({4.0, 4.0, 4.0});
  for (glm::vec3& p : turned.positions_m)  // an edge on top, along y
    p = {p.x - p.z, p.y, p.x + p.z};
  create(row_of(add(turned), {0.0, 0.0, 50.0}));
  const auto query = prepare(NearestTarget::surface, 1, true);
  std::vector<Nearest> points;
  for (int i = 0; i < 13 * 13 * 13; ++i) {
    const glm::vec3 p = 0.5f * glm::vec3(glm::ivec3(i % 13 - 6, i / 13 % 13 - 6, i / 169 - 6));
    points.push_back(near(p));
    points.push_back(near(p + glm::vec3(0.0f, 0.0f, 50.0f)));
  }
  const auto answers = ask(*query, std::span(points).first(4000));
  std::size_t inside = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    glm::dvec3 p(points[i].point_m);
    if (p.z > 25.0) {
      p.z -= 50.0;
      p = {0.5 * (p.x + p.z), p.y, 0.5 * (p.z - p.x)};
    }
    const double beyond = box_distance_m(p, glm::dvec3(2.0));
    ASSERT_EQ(answers[i].neighbors.size(), 1u);
    const float distance_m = answers[i].neighbors[0].distance_m;
    inside += beyond < 0.0 ? 1 : 0;
    if (beyond == 0.0) {
      EXPECT_EQ(distance_m, 0.0f);
    } else {
      ASSERT_EQ(distance_m < 0.0f, beyond < 0.0) << p.x << ", " << p.y << ", " << p.z;
    }
  }
  EXPECT_GT(inside, 300u);
}

using NearestLists = NearestTest;

TEST_F(NearestLists, CoincidingEntitiesGoByIndex) {
  EntityRow row = row_of(add(make_sphere(1.0, 2)), {3.0, -1.0, 2.0});
  row.motion.q_world = {0.8, 0.2, -0.4, 0.1};
  row.motion.w_world_radps = {0.3, 2.0, 0.1};
  auto ids = create(std::vector<EntityRow>(50, row));
  remove(ids[3], {});
  ids.erase(ids.begin() + 3);
  for (const NearestTarget target : {NearestTarget::center, NearestTarget::bounds, NearestTarget::surface}) {
    for (const std::uint32_t k : {1u, 2u, 31u, 32u}) {
      const auto query = prepare(target, k);
      for (int i = 0; i < 20; ++i) {
        const auto neighbors = ask(*query, near(glm::vec3(5.0 * random_.vector()), infinity_f, at_s(0.3)));
        ASSERT_EQ(neighbors.size(), k);
        for (std::uint32_t place = 0; place < k; ++place)
          ASSERT_EQ(neighbors[place].entity, ids[place]) << place;
      }
    }
  }
}

/// The same triangle many times over, among others that lie elsewhere.
TEST_F(NearestLists, CoincidingTrianglesGoByIndex) {
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}, {6, 5, 5}, {5, 6, 5}}, {}};
  std::vector<std::uint32_t> wanted;
  for (std::uint32_t i = 0; i < 90; ++i) {
    const bool there = i >= 7 && i % 3 != 0;
    if (there) wanted.push_back(i);
    mesh.triangles.push_back(there ? glm::uvec3(0, 1, 2) : glm::uvec3(3, 4, 5));
  }
  create(row_of(add(mesh)));
  const auto all = prepare(NearestTarget::triangle, 32);
  const auto neighbors = ask(*all, near({0.2f, 0.3f, 4.0f}));
  ASSERT_EQ(neighbors.size(), 32u);
  for (std::size_t place = 0; place < 32; ++place) {
    EXPECT_EQ(neighbors[place].triangle, wanted[place]);
    EXPECT_EQ(neighbors[place].distance_m, 4.0f);
  }
  const auto one = prepare(NearestTarget::surface);
  EXPECT_EQ(ask(*one, near({0.2f, 0.3f, 4.0f}))[0].triangle, 7u);
  const auto surfaces = prepare(NearestTarget::surface, 2);
  EXPECT_EQ(ask(*surfaces, near({0.2f, 0.3f, 4.0f})).size(), 1u) << "one answer an entity";
}

/// Beyond the edges and corners of a mesh two and more triangles are nearest with one point: the lowest of
/// them.
TEST_F(NearestLists, TrianglesThatShareTheNearestPointGoByIndex) {
  const TriangleMesh mesh = make_sphere(1.0, 2);
  EntityRow row = row_of(add(mesh), {1.0, 2.0, -3.0});
  row.motion.q_world = random_.orientation();
  const EntityId entity = create(row);
  std::vector<Nearest> points;
  std::vector<std::uint32_t> wanted;
  const auto add_point = [&](const glm::dvec3& from, const auto& shares) {
    points.push_back(
        near(glm::vec3(row.motion.p_world_m + row.motion.q_world * (1.7 * glm::normalize(from)))));
    const auto first = std::ranges::find_if(mesh.triangles, shares);
    wanted.push_back(static_cast<std::uint32_t>(first - mesh.triangles.begin()));
  };
  const auto has = [](const glm::uvec3& t, std::uint32_t corner) {
    return t.x == corner || t.y == corner || t.z == corner;
  };
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions_m[t.x]);
    const glm::dvec3 b(mesh.positions_m[t.y]);
    add_point(a, [&](const glm::uvec3& other) { return has(other, t.x); });
    add_point(a + random_.uniform(0.5, 2.0) * b,
              [&](const glm::uvec3& other) { return has(other, t.x) && has(other, t.y); });
  }
  const auto query = prepare(NearestTarget::triangle);
  const auto answers = ask(*query, points);
  std::size_t others = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(answers[i].neighbors.size(), 1u);
    EXPECT_EQ(answers[i].neighbors[0].entity, entity);
    others += answers[i].neighbors[0].triangle == wanted[i] ? 0 : 1;
  }
  EXPECT_EQ(others, 0u) << "of " << points.size();
}

TEST_F(NearestLists, NoMoreThanThereAre) {
  const auto everything = {NearestTarget::center, NearestTarget::bounds, NearestTarget::surface,
                           NearestTarget::triangle};
  for (const NearestTarget target : everything) {
    const auto query = prepare(target, 32);
    EXPECT_TRUE(ask(*query, near({})).empty()) << "an empty world";
  }
  const GeometryId box = add(make_box({2.0, 2.0, 2.0}));
  std::vector<EntityId> ids;
  for (int i = 0; i < 5; ++i) {
    EntityRow row = row_of(box, {10.0 - 2.0 * i, 0.0, 0.0});
    row.mask = 1u << i;
    row.material = 70u + static_cast<std::uint32_t>(i);
    ids.push_back(create(row));
  }
  create(EntityRow{});
  for (const NearestTarget target : everything) {
    for (const std::uint32_t k : {2u, 32u}) {
      const auto query = prepare(target, k);
      Nearest point = near({1.0f, 0.0f, 0.0f}, 1e9f);
      point.mask = 0b10110;
      const auto neighbors = ask(*query, point);
      const std::size_t each = target == NearestTarget::triangle ? 12 : 1;
      ASSERT_EQ(neighbors.size(), std::min<std::size_t>(k, 3 * each));
      EXPECT_EQ(neighbors[0].entity, ids[4]);
      EXPECT_EQ(neighbors[0].mask, 16u);
      EXPECT_EQ(neighbors[0].material, 74u);
      if (k == 32) {
        EXPECT_EQ(neighbors.back().entity, ids[1]);
      }
      point.excluded = ids[4];
      EXPECT_EQ(ask(*query, point)[0].entity, ids[2]);
      point.mask = 1u << 20;
      EXPECT_TRUE(ask(*query, point).empty());
    }
  }
}

TEST_F(NearestLists, AnEmptyBatchHasNoAnswers) {
  create(row_of(add(make_box({2.0, 2.0, 2.0}))));
  const auto query = prepare(NearestTarget::surface, 3);
  EXPECT_EQ(ask(*query, near({})).size(), 1u);
  EXPECT_EQ(execute([&](Transaction& transaction) { transaction.add_query(*query, 0); }).status,
            Status::committed);
  EXPECT_TRUE(query->answers().empty());
}

using NearestRadius = NearestTest;

TEST_F(NearestRadius, HoldsWhatLiesOnIt) {
  create(row_of(add(make_box({2.0, 2.0, 2.0})), {5.0, 0.0, 0.0}));
  const auto found = [&](NearestTarget target, const glm::vec3& p, float radius_m) {
    for (const std::uint32_t k : {1u, 3u}) {
      const auto query = prepare(target, k);
      const auto neighbors = ask(*query, near(p, radius_m));
      if (neighbors.empty()) return -1.0f;
      if (k == 3) return neighbors[0].distance_m;
    }
    return -2.0f;
  };
  const auto less = [](float x) { return std::nextafter(x, 0.0f); };
  for (const NearestTarget target :
       {NearestTarget::bounds, NearestTarget::surface, NearestTarget::triangle}) {
    EXPECT_EQ(found(target, {}, 4.0f), 4.0f);
    EXPECT_EQ(found(target, {}, less(4.0f)), -1.0f);
    EXPECT_EQ(found(target, {1.0f, -5.0f, 0.0f}, 5.0f), 5.0f) << "three, four, five";
    EXPECT_EQ(found(target, {1.0f, -5.0f, 0.0f}, less(5.0f)), -1.0f);
    EXPECT_EQ(found(target, {4.0f, 0.25f, 0.5f}, 0.0f), 0.0f) << "on the surface";
    EXPECT_EQ(found(target, {4.0f, 1.0f, -1.0f}, 0.0f), 0.0f) << "at a corner";
    EXPECT_EQ(found(target, {less(4.0f), 0.25f, 0.5f}, 0.0f), -1.0f);
  }
  EXPECT_EQ(found(NearestTarget::bounds, {5.0f, 0.5f, 0.5f}, 0.0f), 0.0f) << "inside";
  EXPECT_EQ(found(NearestTarget::surface, {5.0f, 0.5f, 0.5f}, 0.0f), -1.0f);
  EXPECT_EQ(found(NearestTarget::center, {}, 5.0f), 5.0f);
  EXPECT_EQ(found(NearestTarget::center, {}, less(5.0f)), -1.0f);
  EXPECT_EQ(found(NearestTarget::center, {5.0f, 0.0f, 0.0f}, 0.0f), 0.0f);
}

class NearestExtremes : public NearestTest {
 protected:
  void expect_agreement(const std::vector<Nearest>& points, NearestTarget target, std::uint32_t k,
                        bool is_signed) {
    const NearestQueryOptions options{
        .name = "nearest", .capacity = 4096, .target = target, .k = k, .is_signed = is_signed};
    const auto query = prepare(target, k, is_signed);
    const auto answers = ask(*query, points);
    const Tally tally = judge(world(), points, answers, options);
    EXPECT_GT(tally.hits, tally.asked / 2);
    EXPECT_LT(tally.too_close, tally.asked / 5);
  }
};

TEST_F(NearestExtremes, ScalesThatDifferAThousandfold) {
  const GeometryId sphere = add(make_sphere(1.0, 3));
  const GeometryId cylinder = add(make_cylinder(1.0, 2.0, 24));
  for (const glm::dvec3 scale :
       {glm::dvec3(0.01, 10.0, 1.0), glm::dvec3(30.0, 0.03, 0.3), glm::dvec3(1e-5)}) {
    std::vector<EntityId> ids;
    for (const GeometryId geometry : {sphere, cylinder}) {
      EntityRow row = row_of(geometry, scale * random_.vector());
      row.scale = scale;
      row.motion.q_world = random_.orientation();
      ids.push_back(create(row));
    }
    std::vector<Nearest> points;
    points.reserve(1000);
    const double size_m = std::max({scale.x, scale.y, scale.z});
    for (int i = 0; i < 1000; ++i)
      points.push_back(near(glm::vec3(size_m * random_.magnitude(0.001, 3.0) * random_.vector())));
    expect_agreement(points, NearestTarget::surface, 2, true);
    expect_agreement(points, NearestTarget::triangle, 3, true);
    expect_agreement(points, NearestTarget::bounds, 2, false);
    for (const EntityId id : ids)
      remove(id, {});
  }
}

TEST_F(NearestExtremes, FarFromTheOrigin) {
  EntityRow row = row_of(add(make_sphere(0.5, 3)), {65'536.0, -32'768.0, 1024.0});
  row.motion.q_world = random_.orientation();
  create(row);
  // Points that single precision holds exactly.
  std::vector<Nearest> points;
  for (int i = 0; i < 2000; ++i) {
    const glm::vec3 offset(glm::ivec3(128.0 * random_.vector()));
    points.push_back(near(glm::vec3(row.motion.p_world_m) + offset / 128.0f));
  }
  expect_agreement(points, NearestTarget::surface, 1, true);
  for (Nearest& point : points)
    point.point_m = glm::vec3(4e4 * random_.direction());
  expect_agreement(points, NearestTarget::bounds, 1, false);
}

/// Lines, needles and points among the triangles.
TEST_F(NearestExtremes, TrianglesOfLittleOrNoArea) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 600; ++i) {
    const glm::dvec3 a = 2.0 * random_.vector();
    const glm::dvec3 b = a + random_.vector();
    const glm::dvec3 between = a + random_.uniform(-0.5, 1.5) * (b - a);
    const glm::dvec3 c = i % 4 == 0 ? a : between + random_.magnitude(1e-9, 1e-1) * random_.vector();
    mesh.positions_m.insert(mesh.positions_m.end(), {glm::vec3(a), glm::vec3(b), glm::vec3(c)});
    mesh.triangles.emplace_back(3 * i, i % 8 == 0 ? 3 * i : 3 * i + 1, 3 * i + 2);
  }
  create(row_of(add(mesh)));
  std::vector<Nearest> points;
  points.reserve(2000);
  for (int i = 0; i < 2000; ++i)
    points.push_back(near(glm::vec3(random_.magnitude(0.1, 20.0) * random_.vector())));
  expect_agreement(points, NearestTarget::triangle, 1, false);
  expect_agreement(points, NearestTarget::triangle, 8, false);
}

}  // namespace
}  // namespace rtstdb::test
