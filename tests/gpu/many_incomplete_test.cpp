// Searches cut short in one batch that are more than a dispatch has workgroups.

#include "tests/gpu/dense_meshes.hpp"

namespace rtstdb::test {
namespace {

class ManyIncomplete : public DatabaseTest {};

/// Whoever was cut short is asked again alone, a workgroup each, and on many a device, lavapipe among them, a dispatch has
/// 65,535 workgroups at the most. Behind more rays than that which are cut short alone, too, stand rays that are answered
/// when they are alone: by the second dispatch. Each takes two to three milliseconds.
TEST_F(ManyIncomplete, RaysBehindAreAnsweredAsEachAlone) {
  Random random(21);
  create(row_of(add(pile(100'000)), {0.0, 0.0, 5.0}));
  const EntityId wall = create(row_of(add(make_box({50.0, 50.0, 1.0})), {1000.0, 0.0, 20.5}));
  create(row_of(add(thicket(random, 300'000)), {1000.0, 0.0, 0.0}));
  constexpr std::uint32_t hopeless = 65'600, last = 64;
  std::vector<Ray> rays(hopeless, ray_from({}, {0, 0, 1}));
  for (std::uint32_t i = 0; i < last; ++i) {
    const glm::vec3 from_m(1000.0 + random.uniform(-3, 3), random.uniform(-3, 3), -20.0);
    rays.push_back(ray_from(from_m, {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 1.0}));
  }
  const auto hits = trace(*prepare_rays(RayMode::closest, false, hopeless + last), rays);
  EXPECT_EQ(std::ranges::count(std::span(hits).first(hopeless), HitStatus::incomplete, &RayHit::status),
            hopeless);
  for (const RayHit& hit : std::span(hits).last(last)) {
    EXPECT_EQ(hit.status, HitStatus::hit);
    EXPECT_EQ(hit.entity, wall);
    EXPECT_FLOAT_EQ(hit.lambda, 40.0f);
  }
}

}  // namespace
}  // namespace rtstdb::test
