#include "rtstdb/query/point_order.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/gpu/random_scene.hpp"

namespace rtstdb::query {
namespace {

std::vector<Nearest> random_points(std::size_t count, const glm::dvec3& size) {
  test::Random random(count);
  std::vector<Nearest> points(count);
  for (Nearest& point : points)
    point.point_m = size * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  return points;
}

TEST(PointOrder, ContainsEachPointOnce) {
  PointOrder order(5000);
  const glm::dvec3 sizes[] = {{1, 1, 1}, {1e5, 1e5, 1e5}, {0, 3, 0}, {0, 0, 0}, {1e-30, 1e-20, 1e5}};
  for (const glm::dvec3& size : sizes) {
    for (const std::size_t count : {0u, 1u, 2u, 3u, 7u, 8u, 64u, 1000u, 5000u}) {
      const auto points = random_points(count, size);
      const auto ordered = order.of(points);
      std::vector<std::uint32_t> sorted(ordered.begin(), ordered.end());
      std::ranges::sort(sorted);
      std::vector<std::uint32_t> all(count);
      std::iota(all.begin(), all.end(), 0u);
      EXPECT_EQ(sorted, all);
      EXPECT_EQ(order.last().size(), count);
      if (size == glm::dvec3(0.0)) {
        EXPECT_TRUE(std::ranges::equal(ordered, all)) << "equal points keep their order";
      }
    }
  }
}

TEST(PointOrder, PlacesClosePointsTogether) {
  const auto points = random_points(4096, {1.0, 1.0, 1.0});
  PointOrder order(4096);
  const auto ordered = order.of(points);
  double before_m = 0.0;
  double after_m = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    before_m += static_cast<double>(glm::distance(points[i - 1].point_m, points[i].point_m));
    after_m += static_cast<double>(glm::distance(points[ordered[i - 1]].point_m, points[ordered[i]].point_m));
  }
  EXPECT_LT(after_m, before_m / 5.0);
}

}  // namespace
}  // namespace rtstdb::query
