// Rays at bodies that turn for long or move fast.

#include <cmath>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

using RayMotion = DatabaseTest;

/// A square column that turns five times a second; the distance to its outline has a closed form.
TEST_F(RayMotion, HitsATurningColumnAtItsOutline) {
  constexpr double rate_radps = 31.0;
  EntityRow row = row_of(add(make_box({2.0, 2.0, 6.0})));
  row.motion.w_world_radps = {0.0, 0.0, rate_radps};
  row.motion.valid_from = at_s(-3600.0);  // it turns for an hour before the first ray
  create(row, at_s(0.0));
  for (int i = 0; i <= 100; ++i) {
    const WorldTime t = at_s(0.0123 * i);
    const double turned_rad = rate_radps * seconds_between(row.motion.valid_from, t);
    const double reach_m = 1.0 / std::max(std::abs(std::cos(turned_rad)), std::abs(std::sin(turned_rad)));
    const RayHit hit = trace(ray_from({10.0f, 0.0f, 0.0f}, {-1, 0, 0}, t));
    ASSERT_EQ(hit.status, HitStatus::hit);
    EXPECT_NEAR(hit.lambda, 10.0 - reach_m, 3e-5) << i;
    EXPECT_LE(glm::length(glm::dvec3(hit.v_relative_mps) - glm::dvec3(0.0, rate_radps * reach_m, 0.0)), 2e-3);
  }
}

/// At the time at which a motion begins, single precision gives its exact pose, early and late in a second.
TEST_F(RayMotion, HitsFastBodiesExactlyWhereTheirMotionBegins) {
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
        const oracle::World oracle_world = world();
        const auto hits = trace(rays);
        const Tally tally = judge(oracle_world, rays, hits);
        EXPECT_EQ(tally.too_close, 0u) << "at " << t_s << " s";
        EXPECT_GT(tally.hits, rays.size() / 2);
        for (std::size_t i = 0; i < rays.size(); ++i) {
          const auto truth = oracle::trace(oracle_world, rays[i]);
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
