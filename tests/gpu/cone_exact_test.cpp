// Cones whose answers are known in closed form, and cones that are rays.

#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <tuple>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

Cone cone_from(const glm::vec3& origin_m, const glm::vec3& direction, double opening_angle_rad,
               WorldTime t = {}) {
  Cone cone;
  cone.origin_m = origin_m;
  cone.direction = direction;
  cone.opening_angle_rad = static_cast<float>(opening_angle_rad);
  cone.t = t;
  return cone;
}

class ConeTest : public DatabaseTest {
 protected:
  /// The returns of all cones, which are traced in batches of at most 4096.
  std::vector<ConeReturn> trace_cones(std::span<const Cone> cones, ConeQueryOptions options = {}) {
    options.name = "cones";
    options.capacity = static_cast<std::uint32_t>(cones.size());
    auto query = database().prepare(options);
    if (!query) {
      ADD_FAILURE() << query.error().message;
      return {};
    }
    std::ranges::copy(cones, query.value()->cones().begin());
    const Outcome outcome =
        execute([&](Transaction& transaction) { transaction.add_query(*query.value(), options.capacity); });
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    const auto returns = query.value()->returns();
    EXPECT_EQ(returns.size(), cones.size() * options.returns_per_cone);
    return {returns.begin(), returns.end()};
  }
  ConeReturn trace_cone(const Cone& cone, const ConeQueryOptions& options = {}) {
    return trace_cones(std::span(&cone, 1), options).front();
  }
  /// Judges and counts as the random tests do.
  void expect_agreement(std::span<const Cone> cones, const ConeQueryOptions& options = {}) {
    const Tally tally = judge(world(), cones, trace_cones(cones, options), options);
    EXPECT_LT(static_cast<double>(tally.too_close), 0.05 * static_cast<double>(tally.elements));
  }
};

/// A plane across the axis is met at its distance, a tilted one where the cone's side meets it first.
TEST_F(ConeTest, MeetsAPlane) {
  EntityRow row = row_of(add(make_rectangle(200.0, 200.0)), {0.0, 0.0, -10.0});
  const EntityId plane = create(row);
  for (const double tilt_rad : {0.0, 0.2, -0.5, 1.0}) {
    for (const double angle_rad : {0.001, 0.1, 0.8}) {
      const glm::vec3 down(std::sin(tilt_rad), 0.0, -std::cos(tilt_rad));
      const ConeReturn one = trace_cone(cone_from({}, 2.0f * down, angle_rad));
      const double half_rad = 0.5 * angle_rad;
      // Along the generator that is inclined towards the plane.
      const double z_m = 10.0 * std::cos(half_rad) / std::cos(std::abs(tilt_rad) - half_rad);
      ASSERT_EQ(one.status, HitStatus::hit) << tilt_rad << ", " << angle_rad;
      EXPECT_EQ(one.entity, plane);
      EXPECT_NEAR(2.0 * static_cast<double>(one.lambda), z_m, 1e-5 * z_m) << tilt_rad << ", " << angle_rad;
      EXPECT_TRUE(one.front_face);
      EXPECT_NEAR(one.n_world.z, 1.0f, 1e-6f);
    }
  }
}

/// The first contact of a cone whose axis passes beside the centre of a sphere.
TEST_F(ConeTest, MeetsASphere) {
  const double radius_m = 1.0;
  create(row_of(add(make_sphere(radius_m, 6)), {20.0, 0.0, 0.0}));
  for (const double angle_rad : {0.02, 0.06, 0.12}) {
    const double half_rad = 0.5 * angle_rad;
    for (const double beside_rad : {0.0, 0.03, 0.06, 0.09, 0.12}) {
      const glm::vec3 along(std::cos(beside_rad), std::sin(beside_rad), 0.0);
      const ConeReturn one = trace_cone(cone_from({}, along, angle_rad));
      const bool meets = beside_rad < half_rad + std::asin(radius_m / 20.0);
      ASSERT_EQ(one.status == HitStatus::hit, meets) << angle_rad << ", " << beside_rad;
      if (!meets) continue;
      // The point of the ball with the least axial coordinate, if it is in the cone; else a point of the
      // generator towards the centre.
      const double pole = 20.0 * std::cos(beside_rad) - radius_m;
      const double pole_beside = 20.0 * std::sin(beside_rad);
      const double off_rad = std::abs(beside_rad - half_rad);
      const double along_m =
          20.0 * std::cos(off_rad) - std::sqrt(radius_m * radius_m - std::pow(20.0 * std::sin(off_rad), 2.0));
      const double z_m = std::atan2(pole_beside, pole) <= half_rad ? pole : along_m * std::cos(half_rad);
      EXPECT_NEAR(static_cast<double>(one.lambda), z_m, 2e-3) << angle_rad << ", " << beside_rad;
    }
  }
}

TEST_F(ConeTest, MeetsTheCornerAndTheEdgeOfABoxFirst) {
  EntityRow row = row_of(add(make_box({2.0, 2.0, 2.0})), {10.0, 0.0, 0.0});
  row.motion.q_world = glm::angleAxis(0.25 * std::numbers::pi, glm::dvec3(0.0, 0.0, 1.0));
  create(row);
  // The edge points at the apex.
  EXPECT_NEAR(trace_cone(cone_from({}, {1, 0, 0}, 0.05)).lambda, 10.0f - std::sqrt(2.0f), 1e-5f);
  // Beside it, where the cone's side meets the face.
  const ConeReturn beside = trace_cone(cone_from({0.0f, 1.2f, 0.0f}, {1, 0, 0}, 0.1));
  const double tan_half = std::tan(0.05);
  // The face: x = 10 - sqrt(2) + y for y > 0; the lower generator: y = 1.2 - z tan.
  const double z_m = (10.0 - std::numbers::sqrt2 + 1.2) / (1.0 + tan_half);
  EXPECT_NEAR(static_cast<double>(beside.lambda), z_m, 1e-5);
  // A corner, from a diagonal.
  const double far_m = std::numbers::sqrt3;
  EntityRow turned = row_of({0}, {-10.0, 0.0, 0.0});
  turned.motion.q_world = glm::angleAxis(std::acos(1.0 / far_m), glm::normalize(glm::dvec3(0.0, 1.0, -1.0)));
  create(turned);
  EXPECT_NEAR(trace_cone(cone_from({}, {-1, 0, 0}, 0.05)).lambda, static_cast<float>(10.0 - far_m), 1e-5f);
}

/// A beam meets a body beside its axis if it is wide enough at the distance of the body.
TEST_F(ConeTest, FootprintGrowsWithDistance) {
  create(row_of(add(make_box({0.02, 0.02, 0.02})), {100.0, 0.5, 0.0}));
  const double reaches_rad = 2.0 * std::atan((0.5 - 0.01) / 100.01);
  EXPECT_EQ(trace_cone(cone_from({}, {1, 0, 0}, reaches_rad * 0.999)).status, HitStatus::miss);
  EXPECT_EQ(trace_cone(cone_from({}, {1, 0, 0}, reaches_rad * 1.001)).status, HitStatus::hit);
  Cone short_of = cone_from({}, {1, 0, 0}, 0.05);
  short_of.lambda_max = 99.9f;
  EXPECT_EQ(trace_cone(short_of).status, HitStatus::miss);
  short_of.lambda_max = 100.1f;
  EXPECT_EQ(trace_cone(short_of).status, HitStatus::hit);
}

TEST_F(ConeTest, WideConesAgreeWithTheOracle) {
  Random random(21);
  const GeometryId sphere = add(make_sphere(1.0, 3));
  const GeometryId box = add(make_box({1.0, 2.0, 3.0}));
  for (int i = 0; i < 20; ++i) {
    EntityRow row = row_of(i % 2 == 0 ? sphere : box, 10.0 * random.vector());
    row.motion.q_world = random.orientation();
    row.scale = {random.magnitude(0.1, 3.0), random.magnitude(0.1, 3.0), random.magnitude(0.1, 3.0)};
    create(row);
  }
  std::vector<Cone> cones;
  for (int i = 0; i < 2000; ++i)
    cones.push_back(cone_from(5.0 * random.vector(), random.vector(),
                              i % 2 == 0 ? random.uniform(0.5, 3.1415) : 3.1415925));
  expect_agreement(cones, {.returns_per_cone = 4});
}

/// The entity is stretched by a factor of ten along one axis: the cone stays round.
TEST_F(ConeTest, StaysRoundUnderAnyScale) {
  EntityRow row = row_of(add(make_rectangle(1.0, 1.0)), {0.0, 0.0, -10.0});
  row.scale = {1.0, 10.0, 1.0};
  row.motion.p_world_m.x = 0.5 + 0.3;  // its border lies 0.3 m beside the axis
  const EntityId plate = create(row);
  const double reaches_rad = 2.0 * std::atan(0.03);
  EXPECT_EQ(trace_cone(cone_from({}, {0, 0, -1}, reaches_rad * 0.999)).status, HitStatus::miss);
  EXPECT_EQ(trace_cone(cone_from({}, {0, 0, -1}, reaches_rad * 1.001)).entity, plate);
  // The same along the other axis.
  row.scale = {10.0, 1.0, 1.0};
  row.motion.p_world_m = {0.0, -0.5 - 0.3, -10.0};
  remove(plate, {});
  create(row);
  EXPECT_EQ(trace_cone(cone_from({}, {0, 0, -1}, reaches_rad * 0.999)).status, HitStatus::miss);
  EXPECT_EQ(trace_cone(cone_from({}, {0, 0, -1}, reaches_rad * 1.001)).status, HitStatus::hit);
}

/// A cone on a carrier starts where the carrier is at the cone's own time.
TEST_F(ConeTest, MovesWithItsCarrier) {
  EntityRow carrier;
  carrier.motion.v_world_mps = {10.0, 0.0, 0.0};
  const EntityId sensor = create(carrier);
  create(row_of(add(make_box({2.0, 2.0, 2.0})), {50.0, 0.0, 0.0}));
  Cone cone = cone_from({1.0f, 0.0f, 0.0f}, {1, 0, 0}, 0.01, at_s(0.5));
  cone.carrier = sensor;
  const ConeReturn one = trace_cone(cone);
  ASSERT_EQ(one.status, HitStatus::hit);
  EXPECT_NEAR(one.lambda, 49.0f - 5.0f - 1.0f, 1e-4f);
  EXPECT_NEAR(one.v_relative_mps.x, -10.0f, 1e-4f);
}

TEST_F(ConeTest, FrontsOrBacksAlone) {
  create(row_of(add(make_box({2.0, 2.0, 2.0})), {10.0, 0.0, 0.0}));
  for (const double angle_rad : {0.0, 0.05}) {
    const auto at = [&](Faces faces) {
      return trace_cone(cone_from({}, {1, 0, 0}, angle_rad), {.faces = faces});
    };
    EXPECT_EQ(at(Faces::both).lambda, 9.0f);
    EXPECT_EQ(at(Faces::front).lambda, 9.0f);
    EXPECT_EQ(at(Faces::back).lambda, 11.0f);
    EXPECT_TRUE(at(Faces::front).front_face);
    EXPECT_FALSE(at(Faces::back).front_face);
  }
}

class ConesThatAreRays : public ConeTest {
 protected:
  static bool same_bits(const ConeReturn& one, const RayHit& hit) {
    const RayHit as_hit{.status = one.status,
                        .lambda = one.lambda,
                        .u = one.u,
                        .v = one.v,
                        .entity = one.entity,
                        .mask = one.mask,
                        .material = one.material,
                        .triangle = one.triangle,
                        .front_face = one.front_face,
                        .n_world = one.n_world,
                        .v_relative_mps = one.v_relative_mps};
    return test::same_bits(as_hit, hit);
  }
};

TEST_F(ConesThatAreRays, HaveTheirBits) {
  Random random(31);
  const SceneOptions scene{.radius_m = 6.0, .version_time = at_s(5.0)};
  std::vector<GeometryId> geometries;
  for (const TriangleMesh& mesh : mixed_meshes(random))
    geometries.push_back(add(mesh));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < 200; ++i)
    rows.push_back(random_row(random, geometries, scene, rows));
  create(rows, scene.version_time);
  const auto states = database().snapshot({});
  std::vector<Ray> rays;
  std::vector<Cone> cones;
  for (int i = 0; i < 10'000; ++i) {
    Cone cone = random_cone(random, states.value(), scene, scene.version_time, 0.9);
    cone.opening_angle_rad = 0.0f;
    Ray ray = ray_from(cone.origin_m, cone.direction, cone.t);
    ray.lambda_max = cone.lambda_max;
    ray.mask = cone.mask;
    ray.carrier = cone.carrier;
    rays.push_back(ray);
    cones.push_back(cone);
  }
  for (const Faces faces : {Faces::both, Faces::front, Faces::back}) {
    auto query = database().prepare(RayQueryOptions{.name = "rays", .capacity = 10'000, .faces = faces});
    ASSERT_TRUE(query.ok());
    const auto hits = trace(*query.value(), rays);
    const auto returns = trace_cones(cones, {.faces = faces});
    std::size_t met = 0;
    std::size_t different = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      met += hits[i].status == HitStatus::hit ? 1 : 0;
      different += same_bits(returns[i], hits[i]) ? 0 : 1;
    }
    EXPECT_EQ(different, 0u) << to_string(faces) << ", " << met << " hits";
    EXPECT_GT(met, 1000u);
  }
}

/// A thin cone meets every triangle that its axis hits, and not later.
TEST_F(ConesThatAreRays, AreMetByEveryConeAboutThem) {
  Random random(32);
  create(row_of(add(make_sphere(1.0, 4))));
  std::vector<Cone> cones;
  for (int i = 0; i < 4000; ++i) {
    const glm::dvec3 from_m = 30.0 * random.direction();
    cones.push_back(cone_from(from_m, 0.5 * random.vector() - from_m, 0.0));
  }
  const auto rays = trace_cones(cones);
  for (const float angle_rad : {1e-30f, 1e-9f, 1e-5f, 1e-3f, 0.3f}) {
    for (Cone& cone : cones)
      cone.opening_angle_rad = angle_rad;
    const auto returns = trace_cones(cones);
    for (std::size_t i = 0; i < cones.size(); ++i) {
      if (rays[i].status != HitStatus::hit) continue;
      ASSERT_EQ(returns[i].status, HitStatus::hit) << angle_rad;
      EXPECT_LE(returns[i].lambda, rays[i].lambda * 1.000001f) << angle_rad;
    }
  }
}

TEST_F(ConeTest, ReturnsAreOrderedAndEachEntityIsOne) {
  const GeometryId box = add(make_box({0.5, 0.5, 0.5}));
  for (int i = 0; i < 12; ++i)
    create(row_of(box, {20.0 - i, 0.0, 0.0}));
  const Cone cone = cone_from({}, {1, 0, 0}, 0.02);
  const auto returns = trace_cones(std::span(&cone, 1), {.returns_per_cone = 8});
  for (std::uint32_t i = 0; i < 8; ++i) {
    EXPECT_EQ(returns[i].status, HitStatus::hit);
    EXPECT_EQ(returns[i].entity.index, 11 - i);
    EXPECT_NEAR(returns[i].lambda, 9.0f + static_cast<float>(i) - 0.25f, 1e-5f);
    EXPECT_EQ(returns[i].fraction, 0.0f);
  }
  const Cone away = cone_from({}, {-1, 0, 0}, 0.02);
  for (const ConeReturn& one : trace_cones(std::span(&away, 1), {.returns_per_cone = 8}))
    EXPECT_EQ(one.status, HitStatus::miss);
}

TEST_F(ConeTest, BadConesAreRefusedWithValueAndLimit) {
  auto query = database().prepare(ConeQueryOptions{.name = "cones", .capacity = 1});
  ASSERT_TRUE(query.ok());
  const auto refusal = [&](const std::function<void(Cone&)>& spoil) {
    Cone& cone = query.value()->cones()[0];
    cone = {};
    spoil(cone);
    const Outcome outcome =
        execute([&](Transaction& transaction) { transaction.add_query(*query.value(), 1); });
    EXPECT_EQ(outcome.status, Status::bad_input);
    return describe(outcome);
  };
  const auto expect = [](const std::string& sentence, const std::string& what) {
    EXPECT_EQ(sentence, "bad_input: " + what + ", in element 0 of query 0; nothing was done");
  };
  const std::string limits = "; it must be 0 to 3.1415925";
  expect(refusal([](Cone& cone) { cone.opening_angle_rad = -0.1f; }),
         "opening_angle_rad is -0.100000001" + limits);
  expect(refusal([](Cone& cone) { cone.opening_angle_rad = 3.14159274f; }),
         "opening_angle_rad is 3.14159274" + limits);
  expect(refusal([](Cone& cone) { cone.opening_angle_rad = std::nanf(""); }),
         "opening_angle_rad is nan" + limits);
  expect(refusal([](Cone& cone) { cone.lambda_max = -1.0f; }), "lambda_max is -1; it must be 0 or above");
  expect(refusal([](Cone& cone) { cone.direction = {}; }),
         "direction is (0, 0, 0); its largest component must be 1e-15 to 1e15");
  expect(refusal([](Cone& cone) { cone.origin_m.y = 2e5f; }),
         "origin_m.y is 200000; it must be -100000 to 100000");
  for (const ConeQueryOptions& options :
       {ConeQueryOptions{.name = "q", .capacity = 0},
        ConeQueryOptions{.name = "q", .capacity = (1u << 20) + 1},
        ConeQueryOptions{.name = "q", .capacity = 1, .returns_per_cone = 0},
        ConeQueryOptions{.name = "q", .capacity = 1, .returns_per_cone = 9}}) {
    const auto refused = database().prepare(options);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::capacity);
    EXPECT_NE(refused.error().message.find("1 to 8 returns of 1 to 1048576 cones are possible"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace rtstdb::test
