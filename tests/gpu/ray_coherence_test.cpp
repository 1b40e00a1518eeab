// Which batches of rays are coherent, so that they are traced as packets.

#include "rtstdb/query/ray/ray_coherence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace rtstdb::query {
namespace {

/// A row of a camera image.
std::vector<Ray> row_of_rays(std::size_t count, float spacing_rad = 1e-3f) {
  std::vector<Ray> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float angle = spacing_rad * static_cast<float>(i);
    rays[i].origin_m = {3.0f, -2.0f, 1.0f};
    rays[i].direction = {std::cos(angle), std::sin(angle), 0.1f};
  }
  return rays;
}

TEST(CoherentRays, HaveNearlyOneDirection) {
  EXPECT_TRUE(are_coherent(row_of_rays(8)));
  EXPECT_TRUE(are_coherent(row_of_rays(1000)));
  EXPECT_TRUE(are_coherent(row_of_rays(8, 0.005f))) << "0.035 rad between the first and the last";
  EXPECT_FALSE(are_coherent(row_of_rays(8, 0.007f))) << "0.049 rad";
}

TEST(CoherentRays, AreAtLeastEight) {
  EXPECT_FALSE(are_coherent({}));
  EXPECT_FALSE(are_coherent(row_of_rays(7)));
  // The incomplete last group does not count.
  auto rays = row_of_rays(15);
  for (std::size_t i = 8; i < rays.size(); ++i)
    rays[i].direction = {0.0f, 0.0f, 1.0f};
  EXPECT_TRUE(are_coherent(rays));
}

TEST(CoherentRays, HaveOneOriginAndOneCarrier) {
  auto rays = row_of_rays(8);
  rays[7].origin_m.y += 0.009f;
  EXPECT_TRUE(are_coherent(rays));
  rays[7].origin_m.y += 0.002f;
  EXPECT_FALSE(are_coherent(rays));
  rays = row_of_rays(8);
  rays[3].carrier = EntityId{.index = 5, .generation = 1};
  EXPECT_FALSE(are_coherent(rays));
  for (Ray& ray : rays)
    ray.carrier = EntityId{.index = 5, .generation = 1};
  EXPECT_TRUE(are_coherent(rays));
}

TEST(CoherentRays, MayHaveDirectionsOfAnyLength) {
  auto rays = row_of_rays(16);
  for (std::size_t i = 0; i < rays.size(); ++i)
    rays[i].direction *= i % 2 == 0 ? 1e-14f : 1e14f;
  EXPECT_TRUE(are_coherent(rays));
  rays[5].direction = -rays[5].direction;
  EXPECT_FALSE(are_coherent(rays)) << "half of the groups";
}

/// Such as the group at the end of an image row.
TEST(CoherentRays, MayHaveOneInEightGroupsSplit) {
  auto rays = row_of_rays(64 * 8);
  for (std::size_t group = 0; group < 8; ++group)
    rays[64 * group + 4].direction = {0.0f, 0.0f, 1.0f};
  EXPECT_TRUE(are_coherent(rays));
  rays[100].direction = {0.0f, 0.0f, 1.0f};
  EXPECT_FALSE(are_coherent(rays));
}

TEST(CoherentRays, AreCheckedToTheEndOfALongBatch) {
  auto rays = row_of_rays(100'000, 1e-6f);
  EXPECT_TRUE(are_coherent(rays));
  for (std::size_t i = rays.size() / 2; i < rays.size(); i += 2)
    rays[i].direction = -rays[i].direction;
  EXPECT_FALSE(are_coherent(rays));
}

}  // namespace
}  // namespace rtstdb::query
