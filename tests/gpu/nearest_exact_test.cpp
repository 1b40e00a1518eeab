// Nearest queries whose answers rounding must not decide: ties, signs, radii and extreme sizes.

#include <algorithm>
#include <cmath>
#include <limits>

#include <rtstdb/limits.hpp>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

constexpr float infinity_f = std::numeric_limits<float>::infinity();

Nearest point_at(const glm::vec3& point_m, float radius_m = infinity_f, WorldTime t = {}) {
  Nearest point;
  point.point_m = point_m;
  point.radius_m = radius_m;
  point.t = t;
  return point;
}

class NearestTest : public DatabaseTest {
 protected:
  std::unique_ptr<NearestQuery> prepare(NearestTarget target, std::uint32_t k = 1, bool is_signed = false) {
    return DatabaseTest::prepare(NearestQueryOptions{
        .name = "nearest", .capacity = 4096, .target = target, .k = k, .is_signed = is_signed});
  }
  std::span<const NearestAnswer> answers_of(NearestQuery& query, std::span<const Nearest> points) {
    std::ranges::copy(points, query.points().begin());
    const Outcome outcome = run(query, points.size());
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    EXPECT_EQ(query.answers().size(), points.size());
    return query.answers();
  }
  std::vector<Neighbor> neighbors_of(NearestQuery& query, const Nearest& point) {
    const auto neighbors = answers_of(query, std::span(&point, 1))[0].neighbors;
    return {neighbors.begin(), neighbors.end()};
  }
  Random random_{91};
};

/// Distance to the faces of a box about the origin, negative inside.
double box_distance_m(const glm::dvec3& p, const glm::dvec3& half) {
  const glm::dvec3 beyond = glm::abs(p) - half;
  const double deepest = std::max({beyond.x, beyond.y, beyond.z});
  return deepest <= 0.0 ? deepest : glm::length(glm::max(beyond, glm::dvec3(0.0)));
}

using NearestSigns = NearestTest;

TEST_F(NearestSigns, OfHollowOverlappingAndOpenMeshes) {
  const auto with = [](TriangleMesh mesh, const TriangleMesh& other, const glm::vec3& offset,
                       bool inside_out) {
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    for (const glm::vec3& p : other.positions_m)
      mesh.positions_m.push_back(p + offset);
    for (const glm::uvec3& t : other.triangles)
      mesh.triangles.push_back(first + (inside_out ? glm::uvec3(t.y, t.x, t.z) : t));
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
    const auto neighbors = neighbors_of(*query, point_at(p));
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

/// The sign counts crossings along z: on a grid around a box, through corners, along edges and within faces.
TEST_F(NearestSigns, AtCornersEdgesAndFaces) {
  create(row_of(add(make_box({4.0, 4.0, 4.0}))));
  TriangleMesh turned = make_box({4.0, 4.0, 4.0});
  for (glm::vec3& p : turned.positions_m)  // an upper edge along y
    p = {p.x - p.z, p.y, p.x + p.z};
  create(row_of(add(turned), {0.0, 0.0, 50.0}));
  const auto query = prepare(NearestTarget::surface, 1, true);
  std::vector<Nearest> points;
  for (int i = 0; i < 13 * 13 * 13; ++i) {
    const glm::vec3 p = 0.5f * glm::vec3(glm::ivec3(i % 13 - 6, i / 13 % 13 - 6, i / 169 - 6));
    points.push_back(point_at(p));
    points.push_back(point_at(p + glm::vec3(0.0f, 0.0f, 50.0f)));
  }
  const auto answers = answers_of(*query, std::span(points).first(4000));
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

TEST_F(NearestLists, OrderCoincidingEntitiesByIndex) {
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
        const auto neighbors =
            neighbors_of(*query, point_at(glm::vec3(5.0 * random_.vector()), infinity_f, at_s(0.3)));
        ASSERT_EQ(neighbors.size(), k);
        for (std::uint32_t place = 0; place < k; ++place)
          ASSERT_EQ(neighbors[place].entity, ids[place]) << place;
      }
    }
  }
}

/// Copies of one triangle, among triangles elsewhere.
TEST_F(NearestLists, OrderCoincidingTrianglesByIndex) {
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}, {6, 5, 5}, {5, 6, 5}}, {}};
  std::vector<std::uint32_t> expected;
  for (std::uint32_t i = 0; i < 90; ++i) {
    const bool is_near = i >= 7 && i % 3 != 0;
    if (is_near) expected.push_back(i);
    mesh.triangles.push_back(is_near ? glm::uvec3(0, 1, 2) : glm::uvec3(3, 4, 5));
  }
  create(row_of(add(mesh)));
  const auto triangles = prepare(NearestTarget::triangle, 32);
  const auto neighbors = neighbors_of(*triangles, point_at({0.2f, 0.3f, 4.0f}));
  ASSERT_EQ(neighbors.size(), 32u);
  for (std::size_t place = 0; place < 32; ++place) {
    EXPECT_EQ(neighbors[place].triangle, expected[place]);
    EXPECT_EQ(neighbors[place].distance_m, 4.0f);
  }
  const auto surface = prepare(NearestTarget::surface);
  EXPECT_EQ(neighbors_of(*surface, point_at({0.2f, 0.3f, 4.0f}))[0].triangle, 7u);
  const auto surfaces = prepare(NearestTarget::surface, 2);
  EXPECT_EQ(neighbors_of(*surfaces, point_at({0.2f, 0.3f, 4.0f})).size(), 1u)
      << "a list has each entity once";
}

/// The nearest point of a mesh is often on an edge or at a corner, which two or more triangles share.
TEST_F(NearestLists, NameTheLowestOfTrianglesThatShareTheNearestPoint) {
  const TriangleMesh mesh = make_sphere(1.0, 2);
  EntityRow row = row_of(add(mesh), {1.0, 2.0, -3.0});
  row.motion.q_world = random_.orientation();
  const EntityId entity = create(row);
  std::vector<Nearest> points;
  std::vector<std::uint32_t> expected;
  const auto add_point = [&](const glm::dvec3& from, const auto& shares) {
    points.push_back(
        point_at(glm::vec3(row.motion.p_world_m + row.motion.q_world * (1.7 * glm::normalize(from)))));
    const auto first = std::ranges::find_if(mesh.triangles, shares);
    expected.push_back(static_cast<std::uint32_t>(first - mesh.triangles.begin()));
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
  const auto answers = answers_of(*query, points);
  std::size_t not_lowest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(answers[i].neighbors.size(), 1u);
    EXPECT_EQ(answers[i].neighbors[0].entity, entity);
    not_lowest += answers[i].neighbors[0].triangle == expected[i] ? 0 : 1;
  }
  EXPECT_EQ(not_lowest, 0u) << "of " << points.size();
}

TEST_F(NearestLists, AreShortIfFewEntitiesQualify) {
  const auto add_box = [&](std::uint32_t layer, double x_m) {
    EntityRow row = row_of(add(make_box({2.0, 2.0, 2.0})), {x_m, 0.0, 0.0});
    row.mask = layer;
    return create(row);
  };
  for (const NearestTarget target :
       {NearestTarget::center, NearestTarget::bounds, NearestTarget::surface, NearestTarget::triangle}) {
    open({});
    const auto query = prepare(target, 32);
    Nearest point = point_at({1.0f, 0.0f, 0.0f}, 1e9f);
    EXPECT_TRUE(neighbors_of(*query, point).empty()) << "an empty world";
    create(EntityRow{});
    const EntityId near = add_box(1, 4.0), far = add_box(1, 9.0);
    add_box(2, 5.0);
    point.mask = 1;
    const auto neighbors = neighbors_of(*query, point);
    ASSERT_EQ(neighbors.size(), target == NearestTarget::triangle ? 24u : 2u);
    EXPECT_EQ(neighbors.front().entity, near);
    EXPECT_EQ(neighbors.back().entity, far);
    point.excluded = near;
    EXPECT_EQ(neighbors_of(*query, point).front().entity, far);
    EXPECT_EQ(run(*query, 0).status, Status::committed);
    EXPECT_TRUE(query->answers().empty());
  }
}

using NearestRadius = NearestTest;

TEST_F(NearestRadius, IncludesWhatLiesOnIt) {
  create(row_of(add(make_box({2.0, 2.0, 2.0})), {5.0, 0.0, 0.0}));
  // The distance of the nearest neighbor; -1 without one.
  const auto found = [&](NearestTarget target, const glm::vec3& p, float radius_m) {
    const auto one = neighbors_of(*prepare(target, 1), point_at(p, radius_m));
    const auto three = neighbors_of(*prepare(target, 3), point_at(p, radius_m));
    EXPECT_EQ(one.empty(), three.empty());
    return one.empty() ? -1.0f : one[0].distance_m;
  };
  const auto less = [](float x) { return std::nextafter(x, 0.0f); };
  for (const NearestTarget target :
       {NearestTarget::bounds, NearestTarget::surface, NearestTarget::triangle}) {
    EXPECT_EQ(found(target, {}, 4.0f), 4.0f);
    EXPECT_EQ(found(target, {}, less(4.0f)), -1.0f);
    EXPECT_EQ(found(target, {1.0f, -5.0f, 0.0f}, 5.0f), 5.0f) << "a triangle of sides 3, 4 and 5";
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
    const auto answers = answers_of(*query, points);
    const Tally tally = judge(world(), points, answers, options);
    EXPECT_GT(tally.hits, tally.elements / 2);
    EXPECT_LT(tally.too_close, tally.elements / 5);
  }
};

TEST_F(NearestExtremes, AgreeWithTheOracleForUnequalScales) {
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
      points.push_back(point_at(glm::vec3(size_m * random_.magnitude(0.001, 3.0) * random_.vector())));
    expect_agreement(points, NearestTarget::surface, 2, true);
    expect_agreement(points, NearestTarget::triangle, 3, true);
    expect_agreement(points, NearestTarget::bounds, 2, false);
    for (const EntityId id : ids)
      remove(id, {});
  }
}

TEST_F(NearestExtremes, AgreeWithTheOracleFarFromTheOrigin) {
  EntityRow row = row_of(add(make_sphere(0.5, 3)), {65'536.0, -32'768.0, 1024.0});
  row.motion.q_world = random_.orientation();
  create(row);
  // Points that single precision holds exactly.
  std::vector<Nearest> points;
  for (int i = 0; i < 2000; ++i) {
    const glm::vec3 offset(glm::ivec3(128.0 * random_.vector()));
    points.push_back(point_at(glm::vec3(row.motion.p_world_m) + offset / 128.0f));
  }
  expect_agreement(points, NearestTarget::surface, 1, true);
  for (Nearest& point : points)
    point.point_m = glm::vec3(4e4 * random_.direction());
  expect_agreement(points, NearestTarget::bounds, 1, false);
}

/// Thin triangles, lines and points.
TEST_F(NearestExtremes, AgreeWithTheOracleForThinTriangles) {
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
    points.push_back(point_at(glm::vec3(random_.magnitude(0.1, 20.0) * random_.vector())));
  expect_agreement(points, NearestTarget::triangle, 1, false);
  expect_agreement(points, NearestTarget::triangle, 8, false);
}

}  // namespace
}  // namespace rtstdb::test
