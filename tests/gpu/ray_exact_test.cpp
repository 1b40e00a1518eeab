// Rays whose hits rounding must not decide: ties, edges and corners, ranges, zero components, extreme sizes.

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

using RayTies = DatabaseTest;

TEST_F(RayTies, OfCoincidingEntitiesGiveTheLowestIndex) {
  const GeometryId sphere = add(make_sphere(1.0, 3));
  EntityRow row = row_of(sphere, {3.0, -1.0, 2.0});
  row.motion.q_world = {0.8, 0.2, -0.4, 0.1};
  row.motion.v_world_mps = {4.0, 1.0, 0.0};
  row.motion.w_world_radps = {0.3, 2.0, 0.1};
  std::vector<EntityId> ids = create(std::vector<EntityRow>(40, row));
  Random random(5);
  const auto expect_lowest = [&](EntityId lowest) {
    std::vector<Ray> rays;
    for (int i = 0; i < 2000; ++i) {
      const WorldTime t = at_s(0.25);
      const glm::dvec3 target_m = pose_at(row.motion, t).p_world_m + 0.3 * random.vector();
      const glm::dvec3 from_m = 20.0 * random.direction();
      rays.push_back(ray_from(from_m, target_m - from_m, t));
    }
    std::size_t hits = 0;
    for (const RayHit& hit : trace(rays)) {
      if (hit.status != HitStatus::hit) continue;
      ++hits;
      ASSERT_EQ(hit.entity, lowest);
    }
    EXPECT_GT(hits, 1500u);
  };
  expect_lowest(ids[0]);
  remove(ids[0], {});
  expect_lowest(ids[1]);
  const EntityId reused = create(row);
  EXPECT_EQ(reused.index, ids[0].index);
  expect_lowest(reused);
}

TEST_F(RayTies, OfCoincidingTrianglesGiveTheLowestNumber) {
  // Copies of one triangle, among triangles elsewhere.
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}, {6, 5, 5}, {5, 6, 5}}, {}};
  for (int i = 0; i < 50; ++i)
    mesh.triangles.emplace_back(i < 7 || i % 3 == 0 ? glm::uvec3(3, 4, 5) : glm::uvec3(0, 1, 2));
  create(row_of(add(mesh)));
  const RayHit hit = trace(ray_from({0.2f, 0.3f, 4.0f}, {0, 0, -1}));
  ASSERT_EQ(hit.status, HitStatus::hit);
  EXPECT_EQ(hit.triangle, 7u);
  EXPECT_EQ(hit.lambda, 4.0f);
}

/// The rounding error of lambda is larger for the large triangle than for the small ones close to it.
TEST_F(RayTies, OfALargeTriangleWithASmallOneCloseToIt) {
  for (const bool use_subgroup_kernels : {true, false}) {
    open({}, {.use_subgroup_kernels = use_subgroup_kernels});
    const TriangleMesh large{{{-3000, -3000, 0}, {3000, -3000, 0}, {0, 3000, 0}}, {{0, 1, 2}}};
    TriangleMesh both = large;
    for (const float z : {2e-5f, -2e-5f}) {
      const auto first = static_cast<std::uint32_t>(both.positions_m.size());
      both.positions_m.insert(both.positions_m.end(), {{-2, -2, z}, {2, -2, z}, {0, 2, z}});
      both.triangles.emplace_back(first, first + 1, first + 2);
    }
    std::vector<EntityRow> rows(3, row_of(add(both)));
    rows[0].geometry = add(large);
    const auto ids = create(rows);
    std::vector<Ray> rays = {ray_from({0.1f, 0.2f, -0.002f}, {0.3f, -0.7f, 0.5f})};
    Random random(9);
    for (int i = 0; i < 4000; ++i)
      rays.push_back(
          ray_from(glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), -0.002), random.direction()));
    std::size_t ties = 0;
    const auto hits = trace(rays);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].status != HitStatus::hit || hits[i].triangle != 0) continue;
      ++ties;
      ASSERT_EQ(hits[i].entity, ids[0]) << "ray " << i << ", subgroup kernels " << use_subgroup_kernels;
    }
    EXPECT_GT(ties, 500u);
  }
}

TEST_F(RayTies, AtTheOriginOfTheRay) {
  create(std::vector<EntityRow>(12, row_of(add(make_box({2.0, 2.0, 2.0})))));
  const RayHit hit = trace(ray_from({-1.0f, 0.1f, 0.2f}, {-1.0f, 0.0f, 0.1f}));
  ASSERT_EQ(hit.status, HitStatus::hit);
  EXPECT_EQ(hit.lambda, 0.0f);
  EXPECT_EQ(hit.entity.index, 0u);
}

/// Lambda follows from distances to far corners, whose rounding errors are larger than its own.
TEST_F(RayTies, CloseToALargeTriangle) {
  for (const double size_m : {10.0, 100.0, 1000.0}) {
    open({});
    create(std::vector<EntityRow>(12, row_of(add(make_rectangle(size_m, size_m)), {3.0, 4.0, 5.0})));
    Random random(3);
    std::vector<Ray> rays;
    for (int k = 0; k < 400; ++k) {
      const glm::dvec3 from_m(0.2 * size_m * random.uniform(-1.0, 1.0),
                              0.2 * size_m * random.uniform(-1.0, 1.0), 5.0 + random.magnitude(0.01, 2.0));
      rays.push_back(ray_from(
          from_m, {random.uniform(0.5, 1.0), random.uniform(-0.5, 0.5), random.uniform(-0.5, -0.1)}));
    }
    std::size_t hits = 0;
    for (const RayHit& hit : trace(rays)) {
      if (hit.status != HitStatus::hit) continue;
      ++hits;
      ASSERT_EQ(hit.entity.index, 0u) << "lambda " << hit.lambda << ", rectangles of " << size_m << " m";
    }
    EXPECT_GT(hits, 200u);
  }
}

/// The edge functions of a small triangle far beside a ray are rounding errors alone. A packet tests each of
/// its rays with the triangles that one of them may hit.
class FarBodies : public DatabaseTest {
 protected:
  /// A camera that looks along x with pixels of 2 mrad.
  static std::vector<Ray> camera() {
    std::vector<Ray> rays;
    for (int z = -80; z < 80; ++z) {
      for (int y = -80; y < 80; ++y)
        rays.push_back(ray_from({}, {1.0, 0.002 * y, 0.002 * z}));
    }
    return rays;
  }
};

TEST_F(FarBodies, AreMissedByRaysBesideThem) {
  const GeometryId ball = add(make_sphere(0.05, 5));
  Random random(1);
  std::vector<EntityRow> rows;
  for (int i = 0; i < 400; ++i) {
    const double distance_m = random.uniform(500.0, 3000.0);
    const double row = static_cast<double>(random.below(160)) - 80.0;
    rows.push_back(
        row_of(ball, {distance_m, distance_m * 0.16 * random.uniform(-1.0, 1.0), distance_m * 0.002 * row}));
    rows.back().motion.q_world = random.orientation();
  }
  create(rows);
  const std::vector<Ray> rays = camera();
  for (const RayMode mode : {RayMode::closest, RayMode::any}) {
    const auto query = prepare_rays(mode, false, static_cast<std::uint32_t>(rays.size()));
    const auto hits = trace(*query, rays);
    std::size_t towards_a_ball = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const glm::dvec3 along = glm::normalize(glm::dvec3(rays[i].direction));
      const bool may_hit = std::ranges::any_of(rows, [&](const EntityRow& row) {
        return glm::length(glm::cross(row.motion.p_world_m, along)) < 0.051;
      });
      towards_a_ball += may_hit ? 1 : 0;
      if (!may_hit) {
        ASSERT_EQ(hits[i].status, HitStatus::miss)
            << "ray " << i << " hits entity " << hits[i].entity.index << " at lambda " << hits[i].lambda;
      }
    }
    EXPECT_GT(towards_a_ball, 10u);
    EXPECT_GT(std::ranges::count(hits, HitStatus::hit, &RayHit::status), 10);
  }
}

TEST_F(FarBodies, OfACentimetreAreMissedFromAKilometre) {
  Random random(1);
  EntityRow row = row_of(add(make_sphere(1.0, 5)), {1000.0, 0.0, 0.0});
  row.scale = glm::dvec3(0.01);
  row.motion.q_world = random.orientation();
  create(row);
  std::vector<Ray> rays;
  for (int i = 0; i < 4000; ++i) {
    // Four far around the ball, four closer, none within 3 m of it.
    const bool around = i % 8 < 4;
    const double turn_rad = around ? 0.7854 + 1.5708 * (i % 4) : random.uniform(0.0, 6.28);
    const double apart_rad = around ? 0.012 : random.uniform(0.003, 0.012);
    rays.push_back(ray_from({}, {1.0, apart_rad * std::cos(turn_rad), apart_rad * std::sin(turn_rad)}));
  }
  for (const RayMode mode : {RayMode::closest, RayMode::any}) {
    const auto hits = trace(*prepare_rays(mode, false), rays);
    EXPECT_EQ(std::ranges::count(hits, HitStatus::hit, &RayHit::status), 0);
  }
}

using RayFaces = DatabaseTest;

TEST_F(RayFaces, LimitHitsToOneSideOfTriangles) {
  const EntityId box = create(row_of(add(make_box({2.0, 2.0, 2.0})), {10.0, 0.0, 0.0}));
  const Ray from_outside = ray_from({}, {1, 0, 0});
  const Ray from_inside = ray_from({10.0f, 0.0f, 0.0f}, {1, 0, 0});
  const struct {
    Faces faces;
    float outside, inside;  // lambda; 0: a miss
  } cases[] = {{Faces::both, 9.0f, 1.0f}, {Faces::front, 9.0f, 0.0f}, {Faces::back, 11.0f, 1.0f}};
  for (const auto& row : cases) {
    for (const RayMode mode : {RayMode::closest, RayMode::any}) {
      const auto query =
          prepare(RayQueryOptions{.name = "faces", .capacity = 2, .mode = mode, .faces = row.faces});
      const Ray rays[] = {from_outside, from_inside};
      const auto hits = trace(*query, rays);
      const float lambdas[] = {row.outside, row.inside};
      for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(hits[i].status, lambdas[i] > 0.0f ? HitStatus::hit : HitStatus::miss);
        if (hits[i].status != HitStatus::hit || mode == RayMode::any) continue;
        EXPECT_EQ(hits[i].lambda, lambdas[i]);
        EXPECT_EQ(hits[i].entity, box);
        EXPECT_EQ(hits[i].front_face, i == 0 && row.faces != Faces::back);
      }
    }
  }
}

/// The memory of hits is reused.
TEST_F(RayFaces, AMissContainsNothingOfAnEarlierHit) {
  create(row_of(add(make_box({2.0, 2.0, 2.0})), {10.0, 0.0, 0.0}));
  const auto query = prepare_rays();
  const Ray towards = ray_from({}, {1, 0, 0});
  const Ray away = ray_from({}, {-1, 0, 0});
  ASSERT_EQ(trace(*query, std::span(&towards, 1))[0].status, HitStatus::hit);
  const RayHit miss = trace(*query, std::span(&away, 1))[0];
  RayHit empty;
  empty.status = HitStatus::miss;
  EXPECT_TRUE(same_bits(miss, empty));
}

using Watertight = DatabaseTest;

/// Rays from the inside, exactly at corners, edges and faces.
TEST_F(Watertight, NoRayLeavesAClosedMesh) {
  Random random(6);
  const TriangleMesh meshes[] = {make_box({2.0, 3.0, 1.0}), make_sphere(1.0, 3), make_cylinder(1.0, 2.0, 64),
                                 make_sphere(1.0, 0)};
  for (const TriangleMesh& mesh : meshes) {
    open({});
    EntityRow row = row_of(add(mesh));
    std::vector<Ray> rays;
    const auto aim = [&](const glm::vec3& target) {
      rays.push_back(ray_from({}, target));
      rays.push_back(ray_from(glm::vec3(0.1 * random.vector()), target));
      rays.back().direction -= rays.back().origin_m;
    };
    for (const glm::uvec3& triangle : mesh.triangles) {
      const glm::vec3 a = mesh.positions_m[triangle.x];
      const glm::vec3 b = mesh.positions_m[triangle.y];
      const glm::vec3 c = mesh.positions_m[triangle.z];
      aim(a);
      aim(0.5f * (a + b));
      aim(a + static_cast<float>(random.uniform(0.0, 1.0)) * (c - a));
      aim((a + b + c) / 3.0f);
    }
    create(row);
    std::size_t leaks = 0;
    for (const RayHit& hit : trace(rays))
      leaks += hit.status == HitStatus::hit ? 0 : 1;
    EXPECT_EQ(leaks, 0u) << "of " << rays.size() << " rays";
    judge(world(), rays, trace(rays));
  }
}

/// Rays through the middle of a turned, scaled and moving sphere, far from the world's origin too.
TEST_F(Watertight, NoRayPassesThroughAClosedMesh) {
  Random random(7);
  const GeometryId sphere = add(make_sphere(1.0, 4));
  for (const double distance_m : {3.0, 300.0, 30'000.0}) {
    EntityRow row = row_of(sphere, {0.5 * distance_m, 3.0, -7.0});
    row.scale = {1.0, 2.0, 0.7};
    row.motion.q_world = random.orientation();
    row.motion.w_world_radps = {3.0, -2.0, 1.0};
    const EntityId entity = create(row);
    std::vector<Ray> rays;
    for (int i = 0; i < 20'000; ++i) {
      const glm::dvec3 from_m = row.motion.p_world_m + distance_m * random.direction();
      rays.push_back(ray_from(from_m, row.motion.p_world_m - from_m, at_s(0.7)));
    }
    std::size_t leaks = 0;
    for (const RayHit& hit : trace(rays))
      leaks += hit.status == HitStatus::hit ? 0 : 1;
    EXPECT_EQ(leaks, 0u) << "from " << distance_m << " m";
    remove(entity, {});
  }
}

/// Vertical rays at the corners and edges of a height field with integer coordinates.
TEST_F(Watertight, NoAxisParallelRayPassesThroughTheEdgesOfAGrid) {
  TriangleMesh mesh;
  constexpr std::uint32_t side = 33;
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x)
      mesh.positions_m.emplace_back(x, y, (x * 7 + y * 3) % 5);
  }
  for (std::uint32_t y = 0; y + 1 < side; ++y) {
    for (std::uint32_t x = 0; x + 1 < side; ++x) {
      const std::uint32_t i = y * side + x;
      mesh.triangles.emplace_back(i, i + 1, i + side);
      mesh.triangles.emplace_back(i + 1, i + side + 1, i + side);
    }
  }
  create(row_of(add(mesh)));
  std::vector<Ray> rays;
  for (std::uint32_t y = 0; y < 4 * (side - 1); ++y) {
    for (std::uint32_t x = 0; x < 4 * (side - 1); ++x)
      rays.push_back(
          ray_from({0.25f * static_cast<float>(x), 0.25f * static_cast<float>(y), 10.0f}, {0, 0, -1}));
  }
  const auto hits = trace(rays);
  judge(world(), rays, hits);
  std::size_t corners = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(hits[i].status, HitStatus::hit) << rays[i].origin_m.x << ", " << rays[i].origin_m.y;
    const glm::vec3& from_m = rays[i].origin_m;
    if (from_m.x != std::floor(from_m.x) || from_m.y != std::floor(from_m.y)) continue;
    ++corners;
    const auto height = static_cast<float>(static_cast<int>(from_m.x * 7 + from_m.y * 3) % 5);
    EXPECT_FLOAT_EQ(hits[i].lambda, 10.0f - height);
  }
  EXPECT_EQ(corners, 32u * 32u);
}

using RayRange = DatabaseTest;

TEST_F(RayRange, IncludesBothEnds) {
  create(row_of(add(make_box({2.0, 2.0, 2.0})), {5.0, 0.0, 0.0}));
  // -1: a miss.
  const auto lambda = [&](float lambda_min, float lambda_max) {
    Ray ray = ray_from({0.0f, 0.2f, 0.3f}, {1, 0, 0});
    ray.lambda_min = lambda_min;
    ray.lambda_max = lambda_max;
    const RayHit hit = trace(ray);
    return hit.status == HitStatus::hit ? hit.lambda : -1.0f;
  };
  const float after_4 = std::nextafter(4.0f, 5.0f);
  EXPECT_EQ(lambda(0.0f, 1e30f), 4.0f);
  EXPECT_EQ(lambda(0.0f, std::numeric_limits<float>::infinity()), 4.0f);
  EXPECT_EQ(lambda(0.0f, 4.0f), 4.0f);
  EXPECT_EQ(lambda(0.0f, std::nextafter(4.0f, 0.0f)), -1.0f);
  EXPECT_EQ(lambda(4.0f, 4.0f), 4.0f);
  EXPECT_EQ(lambda(after_4, 1e30f), 6.0f);
  EXPECT_EQ(lambda(after_4, 6.0f), 6.0f);
  EXPECT_EQ(lambda(std::nextafter(6.0f, 7.0f), 1e30f), -1.0f);
}

class RayExtremes : public DatabaseTest {
 protected:
  void expect_agreement(const std::vector<Ray>& rays, double min_hits, double max_too_close) {
    const Tally tally = judge(world(), rays, trace(rays));
    EXPECT_GT(static_cast<double>(tally.hits), min_hits * static_cast<double>(tally.elements));
    EXPECT_LT(static_cast<double>(tally.too_close), max_too_close * static_cast<double>(tally.elements));
  }
  Random random_{8};
};

TEST_F(RayExtremes, AgreeWithTheOracleForZeroComponentsOfEitherSign) {
  create(row_of(add(make_box({2.0, 4.0, 6.0}))));
  std::vector<Ray> rays;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0f, -1.0f}) {
      for (const float zero : {0.0f, -0.0f}) {
        // The grid has points in the planes of the faces and on the edges.
        for (int i = 0; i < 81; ++i) {
          glm::vec3 direction(zero);
          direction[axis] = sign;
          glm::vec3 from_m(0.0f);
          from_m[axis] = -10.0f * sign;
          const glm::ivec2 cell(i % 9 - 4, i / 9 - 4);
          from_m[(axis + 1) % 3] = static_cast<float>(cell.x);
          from_m[(axis + 2) % 3] = static_cast<float>(cell.y);
          rays.push_back(ray_from(from_m, direction));
        }
      }
    }
  }
  expect_agreement(rays, 0.2, 0.5);
}

TEST_F(RayExtremes, AgreeWithTheOracleForDirectionsOfAnyLength) {
  create(row_of(add(make_sphere(2.0, 3)), {100.0, 50.0, -20.0}));
  std::vector<Ray> rays;
  for (int i = 0; i < 4000; ++i) {
    const glm::dvec3 from_m = 100.0 * random_.vector();
    const glm::dvec3 to_m = glm::dvec3(100.0, 50.0, -20.0) + 1.2 * random_.vector();
    rays.push_back(ray_from(from_m, random_.magnitude(1e-12, 1e12) * glm::normalize(to_m - from_m)));
  }
  expect_agreement(rays, 0.3, 0.005);
}

TEST_F(RayExtremes, AgreeWithTheOracleForFarOrigins) {
  const glm::dvec3 place_m(9e4, -9e4, 5e4);
  create(row_of(add(make_sphere(300.0, 4)), place_m));
  std::vector<Ray> rays;
  for (int i = 0; i < 4000; ++i) {
    const glm::dvec3 from_m = {random_.uniform(-1e5, 1e5), random_.uniform(-1e5, 1e5), -1e5};
    rays.push_back(ray_from(from_m, place_m + 200.0 * random_.vector() - from_m));
  }
  expect_agreement(rays, 0.3, 0.02);
}

TEST_F(RayExtremes, AgreeWithTheOracleForTinyFarMeshes) {
  const GeometryId sphere = add(make_sphere(0.5, 4));
  EntityRow row = row_of(sphere, {65'536.0, -32'768.0, 1024.0});
  row.scale = glm::dvec3(0.05);
  create(row);
  // Origins a metre away that single precision holds exactly.
  std::vector<Ray> rays;
  for (int i = 0; i < 4000; ++i) {
    const glm::vec3 offset(glm::ivec3(64.0 * random_.direction()));
    const glm::vec3 from_m = glm::vec3(row.motion.p_world_m) + offset / 64.0f;
    rays.push_back(ray_from(from_m, glm::vec3(0.015 * random_.vector()) - offset / 64.0f));
  }
  expect_agreement(rays, 0.5, 0.01);
}

TEST_F(RayExtremes, BodiesBeyondTheLimitsHideNothing) {
  create(row_of(add(make_box({1.0, 1.0, 1.0}))));
  // Scaled to 1e10 m, and at 2e14 m after 60 years.
  EntityRow giant = row_of(add(make_box({1e5, 1e5, 1e5})));
  giant.scale = glm::dvec3(1e5);
  EntityRow wanderer = row_of({0}, {0.0, 50.0, 0.0});
  wanderer.motion.v_world_mps = {0.0, 1e5, 0.0};
  create(giant);
  create(wanderer);
  for (const double t_s : {0.0, 2e9}) {
    const WorldTime t = at_s(t_s);
    for (const glm::vec3 along :
         {glm::vec3(1, 0, 0), glm::vec3(1, 1e-10f, 0), glm::vec3(1, 1e-30f, 1e-30f), glm::vec3(1e-10f, 0, 0),
          glm::vec3(1e-15f, -0.0f, 0), glm::vec3(1e15f, 0, 0)}) {
      Ray ray = ray_from({-3.0, 0.0, 0.0}, along, t);
      ray.lambda_max = std::numeric_limits<float>::max();
      const RayHit hit = trace(ray);
      ASSERT_EQ(hit.status, HitStatus::hit) << t_s << " s, along " << along.x << ", " << along.y;
      EXPECT_NEAR(hit.lambda * along.x, 2.5f, 1e-4f);
    }
  }
}

TEST_F(RayExtremes, AgreeWithTheOracleForTinyAndHugeScales) {
  const GeometryId sphere = add(make_sphere(1.0, 3));
  for (const double scale : {1e-5, 1e4}) {
    EntityRow row = row_of(sphere);
    row.scale = glm::dvec3(scale, 2.0 * scale, 0.5 * scale);
    const EntityId entity = create(row);
    std::vector<Ray> rays;
    for (int i = 0; i < 2000; ++i) {
      const glm::dvec3 from_m = 5.0 * scale * random_.direction();
      rays.push_back(ray_from(from_m, 0.7 * scale * random_.vector() - from_m));
    }
    expect_agreement(rays, 0.3, 0.005);
    remove(entity, {});
  }
}

/// From far away rounding makes the inverted box of an empty slot look like a valid one.
TEST_F(RayExtremes, EmptySlotsOfNodesAreNotEnteredFromFarAway) {
  for (const bool use_subgroup_kernels : {true, false}) {
    open({}, {.use_subgroup_kernels = use_subgroup_kernels});
    create(row_of(add(make_sphere(0.5, 6))));
    Random random(12);
    const auto far_m = [&] { return (random.one_in(2) ? 1e5 : -1e5) * random.uniform(0.6, 1.0); };
    std::vector<Ray> rays;
    for (int i = 0; i < 1500; ++i) {
      const glm::dvec3 from_m(far_m(), far_m(), far_m());
      rays.push_back(ray_from(from_m, 0.3 * random.direction() - from_m));
    }
    for (const RayHit& hit : trace(rays))
      ASSERT_EQ(hit.status, HitStatus::hit) << "subgroup kernels " << use_subgroup_kernels;
  }
}

}  // namespace
}  // namespace rtstdb::test
