// Regions by surface and by triangle where the answer is known by itself.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

using enum RegionShape;
using enum RegionTest;

class RegionLevels : public DatabaseTest {
 protected:
  std::unique_ptr<RegionQuery> prepare(RegionLevel level, std::uint32_t ids_per_region = 64,
                                       std::uint32_t capacity = 64) {
    auto query = database().prepare(RegionQueryOptions{
        .name = "regions", .capacity = capacity, .level = level, .ids_per_region = ids_per_region});
    EXPECT_TRUE(query.ok());
    return std::move(query).value();
  }
  Outcome ask(RegionQuery& query, std::span<const Region> regions) {
    std::ranges::copy(regions, query.regions().begin());
    return execute([&](Transaction& transaction) {
      transaction.add_query(query, static_cast<std::uint32_t>(regions.size()));
    });
  }
  RegionAnswer ask(RegionQuery& query, const Region& region) {
    EXPECT_EQ(ask(query, std::span(&region, 1)).status, Status::committed);
    return query.answers()[0];
  }

  /// Which triangle numbers of a single entity are found; nothing else may be.
  struct Expected {
    const char* what;
    Region region;
    std::vector<std::uint32_t> triangles;
  };
  void expect(const EntityId entity, std::span<const Expected> all) {
    const auto listing = prepare(RegionLevel::triangle);
    const auto counting = prepare(RegionLevel::triangle, 0);
    const auto surfaces = prepare(RegionLevel::surface);
    for (const Expected& one : all) {
      const RegionAnswer answer = ask(*listing, one.region);
      std::vector<EntityTriangle> wanted;
      for (const std::uint32_t triangle : one.triangles)
        wanted.push_back({entity, triangle});
      EXPECT_TRUE(std::ranges::equal(answer.triangles, wanted)) << one.what << ": " << answer.found;
      EXPECT_EQ(answer.found, wanted.size()) << one.what;
      EXPECT_TRUE(answer.entities.empty() && !answer.overflow && !answer.incomplete) << one.what;
      const RegionAnswer count = ask(*counting, one.region);
      EXPECT_EQ(count.found, wanted.size()) << one.what;
      EXPECT_TRUE(count.triangles.empty() && !count.overflow && !count.incomplete) << one.what;
      // Every mesh that is asked here has more than what an `inside` of these finds, or just that.
      const RegionAnswer surface = ask(*surfaces, one.region);
      const bool all_of_it = wanted.size() == triangles_;
      const bool held = one.region.test == touching ? !wanted.empty() : all_of_it;
      EXPECT_EQ(surface.found, held ? 1u : 0u) << one.what;
      EXPECT_TRUE(surface.triangles.empty()) << one.what;
      EXPECT_TRUE(std::ranges::equal(surface.entities, std::span(&entity, held ? 1 : 0))) << one.what;
    }
  }
  EntityId create_mesh(const TriangleMesh& mesh) {
    triangles_ = mesh.triangles.size();
    return create(row_of(add(mesh)));
  }

 private:
  std::size_t triangles_ = 0;
};

TEST_F(RegionLevels, ABoxTouchesATriangleAtACornerAnEdgeOrItsFace) {
  const EntityId entity = create_mesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  const auto at = [](const glm::vec3& center_m, float half_m) {
    return region_of(box, touching, center_m, glm::vec3(half_m));
  };
  const Expected all[] = {
      {"corner on corner", at({-0.5f, -0.5f, -0.5f}, 0.5f), {0}},
      {"short of the corner", at({-0.5f, -0.5f, -0.5f}, 0.4995f), {}},
      {"face on edge", at({0.25f, -0.5f, 0.0f}, 0.5f), {0}},
      {"short of the edge", at({0.25f, -0.5f, 0.0f}, 0.4995f), {}},
      {"corner on the slanted edge", at({1.0f, 1.0f, 0.0f}, 0.5f), {0}},
      {"short of the slanted edge", at({1.0f, 1.0f, 0.0f}, 0.4995f), {}},
      {"standing on the face", at({0.25f, 0.25f, 0.125f}, 0.125f), {0}},
      {"above the face", at({0.25f, 0.25f, 0.1255f}, 0.125f), {}},
      {"pierced by the triangle", at({0.25f, 0.25f, 0.0f}, 0.0625f), {0}},
      {"around the triangle", at({0.5f, 0.5f, 0.0f}, 10.0f), {0}},
      {"a point on it", at({0.25f, 0.25f, 0.0f}, 0.0f), {0}},
      {"a point in its plane", at({0.75f, 0.75f, 0.0f}, 0.0f), {}},
      {"a plate in its plane", region_of(box, touching, {1.25f, 0.0f, 0.0f}, {0.25f, 3.0f, 0.0f}), {0}},
      {"a plate in its plane, beside",
       region_of(box, touching, {1.25f, 0.0f, 0.0f}, {0.24f, 3.0f, 0.0f}),
       {}},
  };
  expect(entity, all);
}

TEST_F(RegionLevels, AnOrientedBoxAndOneThatHolds) {
  const EntityId entity = create_mesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  const float reach_m = 0.5f * std::sqrt(2.0f);
  const auto turned = [](const glm::vec3& center_m) {
    Region region = region_of(box, touching, center_m, glm::vec3(0.5f));
    region.q = 3.0f * glm::angleAxis(std::numbers::pi_v<float> / 4, glm::vec3(0, 0, 1));
    return region;
  };
  const auto within = [](const glm::vec3& half_m) {
    return region_of(box, inside, {0.5f, 0.5f, 0.0f}, half_m);
  };
  const Expected all[] = {
      {"its edge reaches the corner", turned({-reach_m + 1e-4f, 0.0f, 0.0f}), {0}},
      {"its edge does not", turned({-reach_m - 1e-4f, 0.0f, 0.0f}), {}},
      {"its face along the slanted edge", turned({0.5f + 0.3534f, 0.5f + 0.3534f, 0.0f}), {0}},
      {"its face beside the slanted edge", turned({0.5f + 0.3537f, 0.5f + 0.3537f, 0.0f}), {}},
      {"just holds it", within({0.5f, 0.5f, 0.0f}), {0}},
      {"loses a corner", within({0.4995f, 0.5f, 1.0f}), {}},
  };
  expect(entity, all);
}

TEST_F(RegionLevels, ASphereTouchesAndHolds) {
  const EntityId entity = create_mesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  const auto ball = [](RegionTest test, const glm::vec3& center_m, float radius_m) {
    return region_of(sphere, test, center_m, {radius_m, 0.0f, 0.0f});
  };
  const Expected all[] = {
      {"on the face", ball(touching, {0.25f, 0.25f, 2.0f}, 2.0f), {0}},
      {"above the face", ball(touching, {0.25f, 0.25f, 2.0f}, 1.9995f), {}},
      {"at a corner", ball(touching, {-3.0f, -4.0f, 0.0f}, 5.0f), {0}},
      {"short of the corner", ball(touching, {-3.0f, -4.0f, 0.0f}, 4.9995f), {}},
      {"at an edge", ball(touching, {0.5f, -3.0f, 4.0f}, 5.0f), {0}},
      {"short of the edge", ball(touching, {0.5f, -3.0f, 4.0f}, 4.9995f), {}},
      {"a point on it", ball(touching, {0.25f, 0.25f, 0.0f}, 0.0f), {0}},
      {"just holds it", ball(inside, {0.0f, 0.0f, 0.0f}, 1.0f), {0}},
      {"loses a corner", ball(inside, {0.0f, 0.0f, 0.0f}, 0.9995f), {}},
  };
  expect(entity, all);
}

TEST_F(RegionLevels, AFrustumTouchesAndHolds) {
  const EntityId entity = create_mesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  // Two metres before the eye the view is 2 m wide and 1 m high to each side.
  const auto view = [](RegionTest test, const glm::vec3& eye_m, float near_m = 0.0f) {
    Region region = region_of(frustum, test, eye_m, {2.0f, 2.0f, 1.0f});
    region.near_m = near_m;
    return region;
  };
  const Expected all[] = {
      {"ends at the corner", view(touching, {-2.0f, 0.0f, 0.0f}), {0}},
      {"ends before it", view(touching, {-2.0005f, 0.0f, 0.0f}), {}},
      {"begins at the corner", view(touching, {0.5f, 0.0f, 0.0f}, 0.5f), {0}},
      {"begins beyond it", view(touching, {0.5f, 0.0f, 0.0f}, 0.5005f), {}},
      {"its eye on the face", view(touching, {0.25f, 0.25f, 0.0f}), {0}},
      {"the corner at the left side", view(touching, {-1.0f, -2.0f, 0.0f}), {0}},
      {"the corner beyond the left side", view(touching, {-1.0f, -2.0005f, 0.0f}), {}},
      {"the edge at the upper side", view(touching, {-0.5f, 0.0f, -0.75f}), {0}},
      {"the edge above the upper side", view(touching, {-0.5f, 0.0f, -0.751f}), {}},
      {"the face below", view(touching, {-1.0f, 0.0f, 1.001f}), {}},
      {"holds all of it", view(inside, {-1.0f, 0.0f, 0.0f}, 1.0f), {0}},
      {"begins too late", view(inside, {-1.0f, 0.0f, 0.0f}, 1.0005f), {}},
      {"ends too early", view(inside, {-1.0005f, 0.0f, 0.0f}), {}},
      {"loses a corner at the left", view(inside, {-0.9995f, 0.0f, 0.0f}), {}},
  };
  expect(entity, all);
}

/// The frustum's slanted edge and an edge of the triangle, which only their common perpendicular tells apart.
TEST_F(RegionLevels, CrossedEdgesAreToldApart) {
  // Beside the edge y = 0.5 x, z = 0.5 x of the view runs an edge that is square to it and to (0, 1, 1).
  const glm::vec3 along = glm::normalize(glm::vec3(0, 1, -1));
  const glm::vec3 foot{1.0f, 0.5f, 0.5f};
  const glm::vec3 outward = glm::normalize(glm::cross(glm::normalize(glm::vec3(2, 1, 1)), along));
  const auto triangle_at = [&](float gap_m) {
    const glm::vec3 m = foot + (outward.y > 0.0f ? gap_m : -gap_m) * outward;
    const glm::vec3 away = m + (outward.y > 0.0f ? 1.0f : -1.0f) * outward;
    return TriangleMesh{{m - along, m + along, away}, {{0, 1, 2}}};
  };
  for (const float gap_m : {-1e-3f, 1e-3f}) {
    open({});
    const EntityId entity = create_mesh(triangle_at(gap_m));
    const Expected one[] = {{"crossed edges", region_of(frustum, touching, {}, {2.0f, 1.0f, 1.0f}),
                             gap_m < 0.0f ? std::vector<std::uint32_t>{0} : std::vector<std::uint32_t>{}}};
    expect(entity, one);
  }
  // A box's edge x = y = 0.5 and an edge across it.
  for (const float gap_m : {-1e-3f, 1e-3f}) {
    open({});
    const float at_m = 0.5f + gap_m;
    const EntityId entity = create_mesh(
        {{{at_m - 1.0f, at_m + 1.0f, -0.25f}, {at_m + 1.0f, at_m - 1.0f, 0.25f}, {3, 3, 0}}, {{0, 1, 2}}});
    const Expected one[] = {{"crossed edges", region_of(box, touching, {}, glm::vec3(0.5f)),
                             gap_m < 0.0f ? std::vector<std::uint32_t>{0} : std::vector<std::uint32_t>{}}};
    expect(entity, one);
  }
}

TEST_F(RegionLevels, TrianglesWithoutAreaAreLinesAndPoints) {
  // A triangle far away, for which the mesh is accepted; a line of three corners, one of two, and a point.
  const EntityId entity =
      create_mesh({{{50, 50, 50}, {51, 50, 50}, {50, 51, 50}, {0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}},
                   {{0, 1, 2}, {3, 4, 5}, {3, 3, 5}, {6, 6, 6}}});
  const auto at = [](RegionShape shape, const glm::vec3& center_m, float half_m) {
    return region_of(shape, touching, center_m, glm::vec3(half_m));
  };
  const Expected all[] = {
      {"a box on the lines", at(box, {1.5f, 1.5f, 1.0f}, 0.25f), {1, 2}},
      {"a box beside them", at(box, {1.5f, 1.5f, 1.0f}, 0.2495f), {}},
      {"a box on the point", at(box, {6.0f, 6.0f, 6.0f}, 1.0f), {3}},
      {"a box beside the point", at(box, {6.0f, 6.0f, 6.0f}, 0.9995f), {}},
      {"a ball at the lines' end", at(sphere, {2.0f, -1.0f, 6.0f}, 5.0f), {1, 2}},
      {"a ball short of it", at(sphere, {2.0f, -1.0f, 6.0f}, 4.9995f), {}},
      {"a ball on the point", at(sphere, {5.0f, 5.0f, 6.0f}, 1.0f), {3}},
      {"a view on the point", region_of(frustum, touching, {4.0f, 5.0f, 5.0f}, {1.0f, 1.0f, 1.0f}), {3}},
      {"a view on the lines", region_of(frustum, touching, {0.0f, 2.0f, 1.0f}, {2.0f, 1.0f, 1.0f}), {1, 2}},
      {"a view beside", region_of(frustum, touching, {0.0f, 2.01f, 1.0f}, {2.0f, 0.99f, 0.5f}), {}},
      {"a box that holds them", region_of(box, inside, {2.5f, 2.5f, 2.5f}, glm::vec3(2.5f)), {1, 2, 3}},
  };
  expect(entity, all);
}

TEST_F(RegionLevels, ASurfaceIsNoBodyAndNoBox) {
  const TriangleMesh mesh = make_sphere(1.0, 4);
  const EntityId entity = create(row_of(add(mesh)));
  const auto triangles = prepare(RegionLevel::triangle, 8192);
  const auto surfaces = prepare(RegionLevel::surface);
  const auto bounds = prepare(RegionLevel::bounds);
  const auto found = [&](const Region& region) {
    return std::array{ask(*bounds, region).found, ask(*surfaces, region).found,
                      ask(*triangles, region).found};
  };
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  EXPECT_EQ(found(region_of(box, touching, {}, glm::vec3(0.3f))), (std::array{1u, 0u, 0u})) << "deep inside";
  EXPECT_EQ(found(region_of(box, touching, glm::vec3(0.95f), glm::vec3(0.1f))), (std::array{1u, 0u, 0u}))
      << "in a corner of its bounds";
  EXPECT_EQ(found(region_of(box, touching, {}, glm::vec3(2.0f))), (std::array{1u, 1u, count}));
  EXPECT_EQ(found(region_of(box, inside, {}, glm::vec3(1.0f))), (std::array{1u, 1u, count}));
  EXPECT_EQ(found(region_of(sphere, inside, {}, glm::vec3(1.0001f))), (std::array{0u, 1u, count}))
      << "its bounds' corners stick out";
  EXPECT_EQ(found(region_of(sphere, touching, {3.0f, 0.0f, 0.0f}, glm::vec3(2.001f)))[1], 1u);
  const RegionAnswer all = ask(*triangles, region_of(sphere, inside, {}, glm::vec3(1.0001f)));
  for (std::uint32_t i = 0; i < count; ++i)
    ASSERT_EQ(all.triangles[i], (EntityTriangle{entity, i}));
  // By where the corners are.
  const RegionAnswer upper = ask(*triangles, region_of(box, inside, {0, 0, 1}, glm::vec3(1.0f)));
  std::vector<EntityTriangle> wanted;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::uvec3& corners = mesh.triangles[i];
    if (mesh.positions_m[corners.x].z >= 0.0f && mesh.positions_m[corners.y].z >= 0.0f &&
        mesh.positions_m[corners.z].z >= 0.0f)
      wanted.push_back({entity, i});
  }
  EXPECT_TRUE(std::ranges::equal(upper.triangles, wanted));
  EXPECT_GT(wanted.size(), count / 3);
}

TEST_F(RegionLevels, ScaleIsThatOfTheEntity) {
  // The unit square from 0 to 1, stretched to 4 by 0.5, turned by a quarter about z: x from -0.5 to 0, y to
  // 4.
  const GeometryId square = add({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}});
  EntityRow row = row_of(square, {10.0, 0.0, 0.0});
  row.scale = {4.0, 0.5, 3.0};
  row.motion.q_world = glm::angleAxis(std::numbers::pi / 2, glm::dvec3(0, 0, 1));
  create(row);
  const auto query = prepare(RegionLevel::triangle);
  const auto triangles_at = [&](const glm::vec3& center_m, float radius_m) {
    std::vector<std::uint32_t> numbers;
    for (const EntityTriangle& one :
         ask(*query, region_of(sphere, touching, center_m, glm::vec3(radius_m))).triangles)
      numbers.push_back(one.triangle);
    return numbers;
  };
  using Numbers = std::vector<std::uint32_t>;
  EXPECT_EQ(triangles_at({10.0f, 4.0f, 0.0f}, 1e-3f), Numbers{0}) << "the corner (1, 0)";
  EXPECT_EQ(triangles_at({9.5f, 0.0f, 0.0f}, 1e-3f), Numbers{1}) << "the corner (0, 1)";
  EXPECT_EQ(triangles_at({9.5f, 4.0f, 0.0f}, 1e-3f), (Numbers{0, 1})) << "the corner (1, 1)";
  EXPECT_EQ(triangles_at({9.75f, 2.0f, 1.0f}, 1.001f), (Numbers{0, 1})) << "the diagonal";
  EXPECT_EQ(triangles_at({9.75f, 2.0f, 1.0f}, 0.999f), Numbers{});
}

TEST_F(RegionLevels, EachAtItsTimeAndCarried) {
  const GeometryId square = add(make_rectangle(1.0, 1.0));
  EntityRow wall = row_of(square, {10.0, 0.0, 0.0});
  wall.motion.q_world = glm::angleAxis(std::numbers::pi / 2, glm::dvec3(0, 1, 0));
  wall.motion.v_world_mps = {-5.0, 0.0, 0.0};
  wall.mask = 2;
  EntityRow car;  // without geometry
  car.motion.v_world_mps = {5.0, 0.0, 0.0};
  car.mask = 2;
  const auto ids = create(std::vector{car, wall});
  const auto query = prepare(RegionLevel::triangle);
  std::vector<Region> regions;
  // At x = 10 - 5 t stands the wall; where nothing carries it the region waits at x = 7.5.
  for (const double t_s : {0.0, 0.25, 0.5, 0.75}) {
    for (const bool carried : {false, true}) {
      Region region = region_of(box, touching, {carried ? 5.0f : 7.5f, 0.2f, 0.0f}, {0.125f, 0.125f, 0.125f});
      region.t = at_s(t_s);
      if (carried) region.carrier = ids[0];
      regions.push_back(region);
    }
  }
  Region masked = regions[4];
  masked.mask = ~2u;
  regions.push_back(masked);
  EXPECT_EQ(ask(*query, regions).status, Status::committed);
  // The carried one meets it at 5 + 5 t = 10 - 5 t.
  const std::uint32_t wanted[] = {0, 0, 0, 0, 2, 2, 0, 0, 0};
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const RegionAnswer& answer = query->answers()[i];
    EXPECT_EQ(answer.found, wanted[i]) << i;
    for (std::uint32_t k = 0; k < answer.found; ++k)
      EXPECT_EQ(answer.triangles[k], (EntityTriangle{ids[1], k})) << i;
  }
}

TEST_F(RegionLevels, OverflowKeepsTheLowestAndTheTrueCount) {
  const GeometryId ball = add(make_sphere(1.0, 2));  // of 320 triangles
  const GeometryId cube = add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < 60; ++i)
    rows.push_back(row_of(i % 3 == 0 ? ball : cube, {3.0 * ((i * 37) % 60), 0.0, 0.0}));
  const auto ids = create(rows);
  std::vector<EntityTriangle> all;
  for (std::uint32_t i = 0; i < 60; ++i) {
    for (std::uint32_t k = 0; k < (i % 3 == 0 ? 320u : 12u); ++k)
      all.push_back({ids[i], k});
  }
  const Region everywhere = region_of(box, touching, {}, glm::vec3(1e4f));
  for (const std::uint32_t room : {1u, 2u, 64u, 321u, 700u, 6879u}) {
    const auto query = prepare(RegionLevel::triangle, room, 2);
    // The other one overflows or does not, by itself.
    const Region regions[] = {everywhere, region_of(frustum, inside, {-5.0f, 0.0f, 0.0f}, glm::vec3(6.0f))};
    EXPECT_EQ(ask(*query, regions).status, Status::truncated);
    const RegionAnswer& answer = query->answers()[0];
    EXPECT_TRUE(answer.overflow);
    EXPECT_FALSE(answer.incomplete);
    EXPECT_EQ(answer.found, all.size());
    EXPECT_TRUE(std::ranges::equal(answer.triangles, std::span(all).first(room))) << room;
    // Those of the ball at the origin whose corners all stand before x = 1.
    EXPECT_EQ(query->answers()[1].found, 320u);
    EXPECT_EQ(query->answers()[1].overflow, room < 320);
    EXPECT_TRUE(
        std::ranges::equal(query->answers()[1].triangles, std::span(all).first(std::min(room, 320u))));
  }
  const auto query = prepare(RegionLevel::triangle, 6880, 1);
  EXPECT_EQ(ask(*query, std::span(&everywhere, 1)).status, Status::committed) << "exactly full";
  EXPECT_TRUE(std::ranges::equal(query->answers()[0].triangles, all));
  EXPECT_EQ(ask(*prepare(RegionLevel::triangle, 0, 1), everywhere).found, all.size());

  const auto surfaces = prepare(RegionLevel::surface, 7, 1);
  EXPECT_EQ(ask(*surfaces, std::span(&everywhere, 1)).status, Status::truncated);
  EXPECT_EQ(surfaces->answers()[0].found, 60u);
  EXPECT_TRUE(surfaces->answers()[0].overflow);
  EXPECT_TRUE(std::ranges::equal(surfaces->answers()[0].entities, std::span(ids).first(7)));
  EXPECT_EQ(ask(*prepare(RegionLevel::surface, 0, 1), everywhere).found, 60u);
}

TEST_F(RegionLevels, NothingIsFoundInAnEmptyWorldAndWithoutGeometry) {
  const auto triangles = prepare(RegionLevel::triangle);
  const auto surfaces = prepare(RegionLevel::surface);
  const Region everywhere = region_of(box, touching, {}, glm::vec3(1e4f));
  EXPECT_EQ(ask(*triangles, everywhere).found, 0u);
  create(EntityRow{});
  EXPECT_EQ(ask(*triangles, everywhere).found, 0u);
  EXPECT_EQ(ask(*surfaces, everywhere).found, 0u);
  EXPECT_EQ(ask(*triangles, std::span<const Region>{}).status, Status::committed);
  EXPECT_TRUE(triangles->answers().empty());
  // Geometry that comes after the query was prepared, and goes.
  const EntityId entity = create(row_of(add(make_box({1.0, 1.0, 1.0}))));
  EXPECT_EQ(ask(*triangles, everywhere).found, 12u);
  EXPECT_EQ(ask(*surfaces, everywhere).found, 1u);
  remove(entity, {});
  EXPECT_EQ(ask(*triangles, everywhere).found, 0u);
}

}  // namespace
}  // namespace rtstdb::test
