// Moving bodies and moving rays against closed forms.

#include <cmath>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

class RayMotion : public DatabaseTest {
 protected:
  RayHit hit(const Ray& ray) {
    const RayHit found = trace(ray);
    EXPECT_EQ(found.status, HitStatus::hit);
    return found;
  }
  static void expect_near(const glm::vec3& a, const glm::dvec3& b, double tolerance) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
  }
};

TEST_F(RayMotion, ABoxIsHitWhereItIsAtTheRaysTime) {
  EntityRow row = row_of(add(make_box({2.0, 2.0, 2.0})), {20.0, 0.0, 0.0});
  row.motion.v_world_mps = {-12.0, 0.5, 0.0};
  row.motion.valid_from = at_s(100.0);
  create(row, at_s(100.0));
  for (const double t : {0.0, 0.001, 0.25, 0.5, 0.9999, 1.0, 1.3}) {
    const RayHit found = hit(ray_from({0.0f, 0.0f, 0.1f}, {1, 0, 0}, at_s(100.0 + t)));
    EXPECT_NEAR(found.lambda, 19.0 - 12.0 * t, 2e-5) << t;
    expect_near(found.v_relative_mps, {-12.0, 0.5, 0.0}, 1e-5);
    expect_near(found.n_world, {-1.0, 0.0, 0.0}, 1e-6);
    EXPECT_TRUE(found.front_face);
  }
}

TEST_F(RayMotion, WithMotionIgnoredItStandsWhereTheVersionBegan) {
  EntityRow row = row_of(add(make_box({2.0, 2.0, 2.0})), {20.0, 0.0, 0.0});
  row.motion.v_world_mps = {-12.0, 0.0, 0.0};
  row.motion.valid_from = at_s(99.5);
  create(row, at_s(100.0));
  const auto query = prepare_rays(RayMode::closest, true);
  for (const double t : {90.0, 100.0, 100.7, 5000.0}) {
    const Ray ray = ray_from({}, {1, 0, 0}, at_s(t));
    const RayHit found = trace(*query, std::span(&ray, 1))[0];
    EXPECT_NEAR(found.lambda, 13.0, 2e-5) << t;
    expect_near(found.v_relative_mps, {-12.0, 0.0, 0.0}, 1e-5);
  }
}

/// The corners of a subdivided icosahedron lie on the sphere, its faces a little inside.
TEST_F(RayMotion, ASphereIsHitWithinItsChordError) {
  constexpr double radius_m = 2.0;
  const TriangleMesh mesh = make_sphere(radius_m, 5);
  double inner_m = radius_m;
  for (const glm::uvec3& triangle : mesh.triangles) {
    const glm::dvec3 a(mesh.positions_m[triangle.x]);
    const glm::dvec3 normal = glm::normalize(glm::cross(glm::dvec3(mesh.positions_m[triangle.y]) - a,
                                                        glm::dvec3(mesh.positions_m[triangle.z]) - a));
    inner_m = std::min(inner_m, glm::dot(normal, a));
  }
  ASSERT_GT(inner_m, 0.998 * radius_m);
  EntityRow row = row_of(add(mesh), {0.0, 15.0, 1.0});
  row.motion.v_world_mps = {3.0, -8.0, 2.0};
  row.motion.w_world_radps = {0.0, 7.0, 20.0};
  create(row);
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.05 * i;
    const glm::dvec3 center_m = row.motion.p_world_m + row.motion.v_world_mps * t;
    const glm::dvec3 direction = glm::normalize(center_m + glm::dvec3(0.7, 0.0, 0.4));
    const double along_m = glm::dot(center_m, direction);
    const double off_m2 = glm::dot(center_m, center_m) - along_m * along_m;
    const RayHit found = hit(ray_from({}, direction, at_s(t)));
    EXPECT_GE(found.lambda, along_m - std::sqrt(radius_m * radius_m - off_m2) - 1e-4);
    EXPECT_LE(found.lambda, along_m - std::sqrt(inner_m * inner_m - off_m2) + 1e-4);
    const glm::dvec3 arm_m = static_cast<double>(found.lambda) * direction - center_m;
    expect_near(found.v_relative_mps, row.motion.v_world_mps + glm::cross(row.motion.w_world_radps, arm_m),
                2e-3);
  }
}

/// A square column turns five times a second about its axis: the beam meets its outline at the angle of the
/// time.
TEST_F(RayMotion, ATurningColumnShowsItsOutline) {
  constexpr double rate_radps = 31.0;
  EntityRow row = row_of(add(make_box({2.0, 2.0, 6.0})));
  row.motion.w_world_radps = {0.0, 0.0, rate_radps};
  row.motion.valid_from = at_s(-3600.0);  // it has turned for an hour
  create(row, at_s(0.0));
  for (int i = 0; i <= 100; ++i) {
    const WorldTime t = at_s(0.0123 * i);
    const double turned_rad = rate_radps * seconds_between(row.motion.valid_from, t);
    // The outline seen along the body's own direction -turned.
    const double reach_m = 1.0 / std::max(std::abs(std::cos(turned_rad)), std::abs(std::sin(turned_rad)));
    const RayHit found = hit(ray_from({10.0f, 0.0f, 0.0f}, {-1, 0, 0}, t));
    EXPECT_NEAR(found.lambda, 10.0 - reach_m, 3e-5) << i;
    expect_near(found.v_relative_mps, {0.0, rate_radps * reach_m, 0.0}, 2e-3);
  }
}

TEST_F(RayMotion, ACarriedRayMovesAndTurnsWithItsCarrier) {
  create(row_of(add(make_box({2.0, 4000.0, 4000.0})), {101.0, 0.0, 0.0}));
  EntityRow row;  // a carrier need not be seen
  row.motion.p_world_m = {10.0, 5.0, 0.0};
  row.motion.v_world_mps = {20.0, 0.0, 1.0};
  row.motion.w_world_radps = {0.0, 0.0, 0.8};
  const EntityId carrier = create(row);
  for (int i = 0; i <= 10; ++i) {
    const double t = 0.1 * i;
    Ray ray = ray_from({0.0f, 2.0f, 0.5f}, {3, 0, 0}, at_s(t));
    ray.carrier = carrier;
    const double angle = 0.8 * t;
    // Where the point (0, 2) of the carrier is, and how it goes.
    const glm::dvec3 arm_m(-2.0 * std::sin(angle), 2.0 * std::cos(angle), 0.5);
    const glm::dvec3 origin_m = row.motion.p_world_m + row.motion.v_world_mps * t + arm_m;
    const glm::dvec3 v_origin = row.motion.v_world_mps + glm::cross(row.motion.w_world_radps, arm_m);
    const RayHit found = hit(ray);
    EXPECT_NEAR(found.lambda, (100.0 - origin_m.x) / (3.0 * std::cos(angle)), 2e-4) << t;
    expect_near(found.v_relative_mps, -v_origin, 1e-4);
  }
}

TEST_F(RayMotion, ACarriedRayMaySeeItsCarrier) {
  EntityRow row = row_of(add(make_box({2.0, 2.0, 2.0})), {7.0, 0.0, 0.0});
  row.motion.v_world_mps = {30.0, -4.0, 2.0};
  row.motion.w_world_radps = {1.0, 5.0, -2.0};
  row.mask = 4;
  row.material = 77;
  const EntityId body = create(row);
  Ray ray = ray_from({5.0f, 0.2f, 0.0f}, {-1, 0, 0}, at_s(0.6));
  ray.carrier = body;
  const RayHit found = hit(ray);
  EXPECT_EQ(found.entity, body);
  EXPECT_EQ(found.mask, 4u);
  EXPECT_EQ(found.material, 77u);
  EXPECT_NEAR(found.lambda, 4.0, 2e-5);
  // The point hit and the origin turn with one body: between them only the turning of the line that joins
  // them.
  const glm::dvec3 way_m = pose_at(row.motion, ray.t).q_world * glm::dvec3(-4.0, 0.0, 0.0);
  expect_near(found.v_relative_mps, glm::cross(row.motion.w_world_radps, way_m), 1e-3);
  ray.mask = 3;
  EXPECT_EQ(trace(ray).status, HitStatus::miss);
}

/// An answer does not change with the length of time that its batch spans, nor with the age of the motion.
TEST_F(RayMotion, AnswersDoNotDependOnTheWindow) {
  EntityRow row = row_of(add(make_sphere(1.0, 3)), {8.0, 0.0, 0.0});
  row.motion.v_world_mps = {1.0, 0.4, 0.0};
  row.motion.w_world_radps = {3.0, 20.0, -7.0};
  row.motion.valid_from = at_s(-20.0);
  row.motion.p_world_m -= 20.0 * row.motion.v_world_mps;
  create(row, at_s(0.0));
  for (const double t : {0.3, 1.0, 1.9, 2.0}) {
    std::vector<Ray> rays{ray_from({0.0f, 0.1f, 0.2f}, {1, 0.1f, 0}, at_s(t))};
    const float alone = trace(rays)[0].lambda;
    for (const double other : {-0.9, -0.2, 0.1, 0.99}) {
      if (t + other < 0.0) continue;
      rays.resize(1);
      rays.push_back(ray_from({}, {0, 0, 1}, at_s(t + other)));
      EXPECT_EQ(trace(rays)[0].lambda, alone) << "at " << t << " together with " << t + other;
    }
  }
}

/// Single precision knows best where a motion began: rays that ask then see fast bodies where they are, early
/// or late in a second.
TEST_F(RayMotion, FastBodiesAreWhereTheirMotionBegins) {
  const GeometryId box = add(make_box({1.0, 1.0, 1.0}));
  Random random(5);
  for (const double t_s : {5.0, 5.001, 5.999, -7.25}) {
    for (const glm::dvec3& v_mps :
         {glm::dvec3(300.0, 210.0, 90.0), glm::dvec3(30'000.0, -21'000.0, 9'000.0)}) {
      for (const bool turns : {false, true}) {
        open({});
        add(make_box({1.0, 1.0, 1.0}));
        EntityRow row = row_of(box, {2.0, 0.0, 0.0});
        (turns ? row.motion.w_world_radps : row.motion.v_world_mps) = turns ? 0.2 * v_mps : v_mps;
        row.motion.valid_from = at_s(t_s);
        create(row, at_s(t_s));
        std::vector<Ray> rays(300);
        for (Ray& ray : rays) {
          ray = ray_from(glm::vec3(2, 0, 0) + glm::vec3(3.0 * random.direction()), {}, at_s(t_s));
          ray.direction = glm::vec3(2, 0, 0) + glm::vec3(0.2 * random.vector()) - ray.origin_m;
        }
        const auto there = world();
        const auto hits = trace(rays);
        const Tally tally = judge(there, rays, hits);
        EXPECT_EQ(tally.too_close, 0u) << "at " << t_s << " s";
        EXPECT_GT(tally.hits, rays.size() / 2);
        for (std::size_t i = 0; i < rays.size(); ++i) {
          const auto truth = oracle::trace(there, rays[i]);
          const bool same = truth.status == hits[i].status && truth.triangle == hits[i].triangle;
          if (!same || truth.status != HitStatus::hit) continue;
          EXPECT_NEAR(static_cast<double>(hits[i].lambda), static_cast<double>(truth.lambda), 1e-5)
              << "at " << t_s << " s";
        }
      }
    }
  }
}

}  // namespace
}  // namespace rtstdb::test
