// The maximal number of entities in a database and of rays in a query.

#include "tests/gpu/database_fixture.hpp"

namespace rtstdb::test {
namespace {

using SizeLimits = DatabaseTest;

/// Boxes on a grid and vertical rays.
TEST_F(SizeLimits, EachOfAMillionEntitiesIsHit) {
  constexpr std::uint32_t side = 1024;
  static_assert(side * side == max_entities);
  open({.max_entities = max_entities, .retained_changes = 1});
  const GeometryId box = add(make_box({0.6, 0.6, 0.6}));
  const auto place_m = [](std::uint32_t i) { return glm::dvec3(i % side, i / side, 0.0); };
  std::vector<EntityRow> rows;
  rows.reserve(max_entities);
  for (std::uint32_t i = 0; i < max_entities; ++i) {
    EntityRow row = row_of(box, place_m(i));
    row.motion.v_world_mps = {0.0, 0.0, 10.0};
    rows.push_back(row);
  }
  const std::vector<EntityId> ids = create(rows);
  ASSERT_EQ(ids.size(), max_entities);
  std::vector<Ray> rays;
  for (std::uint32_t k = 0; k < 4000; ++k) {
    const std::uint32_t i = k * 262'139u % max_entities;
    // Every second ray passes between the boxes.
    const glm::dvec3 from_m = place_m(i) + glm::dvec3(k % 2 == 0 ? 0.1 : 0.5, 0.1, 50.0);
    rays.push_back(ray_from(from_m, {0, 0, -1}, at_s(k % 3 == 0 ? 0.0 : 1.0)));
  }
  const auto hits = trace(rays);
  for (std::uint32_t k = 0; k < rays.size(); ++k) {
    ASSERT_EQ(hits[k].status, k % 2 == 0 ? HitStatus::hit : HitStatus::miss) << k;
    if (k % 2 != 0) continue;
    EXPECT_EQ(hits[k].entity, ids[k * 262'139u % max_entities]);
    EXPECT_NEAR(hits[k].lambda, k % 3 == 0 ? 49.7f : 39.7f, 1e-3f);
  }
}

TEST_F(SizeLimits, FourMillionRaysAreOneBatch) {
  create(row_of(add(make_rectangle(2.0, 2.0))));
  const auto query = prepare_rays(RayMode::any, false, max_rays_per_query);
  std::uint32_t k = 0;
  for (Ray& ray : query->rays()) {
    ray = ray_from({k % 3 == 0 ? 0.5f : 1.5f, 0.3f, 1.0f}, {0, 0, -1});
    ++k;
  }
  const Outcome outcome = run(*query, max_rays_per_query);
  ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
  k = 0;
  for (const RayHit& hit : query->hits()) {
    ASSERT_EQ(hit.status, k % 3 == 0 ? HitStatus::hit : HitStatus::miss) << k;
    ++k;
  }
  EXPECT_EQ(k, max_rays_per_query);
}

}  // namespace
}  // namespace rtstdb::test
