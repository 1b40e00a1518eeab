#include "runtime/modules/vehicles/car_shape.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace hil::modules {
namespace {

const glm::dvec3 sizes_m[] = {{4.5, 1.8, 1.5}, {12.0, 2.5, 3.2}, {0.1, 0.1, 0.1}, {50.0, 50.0, 50.0}};

TEST(CarShape, IsAValidMeshThatFillsItsBox) {
  for (const glm::dvec3& size_m : sizes_m) {
    EXPECT_TRUE(rtstdb::validate(make_car(size_m)));
    const rtstdb::Bounds bounds = rtstdb::bounds_of(make_car(size_m));
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(bounds.maximum_m[axis], 0.5 * size_m[axis], 1e-5 * size_m[axis]);
      EXPECT_NEAR(bounds.minimum_m[axis], -0.5 * size_m[axis], 1e-5 * size_m[axis]);
    }
  }
}

/// Every edge is used once in each direction: the surface has no hole and one orientation.
TEST(CarShape, IsClosed) {
  const rtstdb::TriangleMesh car = make_car(sizes_m[0]);
  using Key = std::tuple<float, float, float>;
  const auto key = [&](glm::uint corner) {
    const glm::vec3& p = car.positions_m[corner];
    return Key(p.x, p.y, p.z);
  };
  std::map<std::pair<Key, Key>, int> passes;
  for (const glm::uvec3& t : car.triangles) {
    for (int i = 0; i < 3; ++i)
      ++passes[{key(t[i]), key(t[(i + 1) % 3])}];
  }
  ASSERT_FALSE(passes.empty());
  for (const auto& [edge, count] : passes) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(passes.count({edge.second, edge.first}), 1U);
  }
}

/// The volume by the divergence theorem is positive when the front faces are outside.
TEST(CarShape, HasItsFrontFacesOutside) {
  for (const glm::dvec3& size_m : sizes_m) {
    const rtstdb::TriangleMesh car = make_car(size_m);
    double volume_m3 = 0.0;
    for (const glm::uvec3& t : car.triangles) {
      const glm::dvec3 a = car.positions_m[t.x];
      const glm::dvec3 b = car.positions_m[t.y];
      const glm::dvec3 c = car.positions_m[t.z];
      volume_m3 += glm::dot(a, glm::cross(b, c)) / 6.0;
    }
    const double box_m3 = size_m.x * size_m.y * size_m.z;
    EXPECT_GT(volume_m3, body_height_m(size_m) / size_m.z * box_m3);
    EXPECT_LT(volume_m3, box_m3);
  }
}

TEST(CarShape, HasVerticalSidesUpToTheHeightOfTheBody) {
  const glm::dvec3 size_m = sizes_m[0];
  const double top_m = body_height_m(size_m) - 0.5 * size_m.z;  // in the entity frame
  EXPECT_GT(body_height_m(size_m), 0.3 * size_m.z);
  EXPECT_LT(body_height_m(size_m), size_m.z);
  const rtstdb::TriangleMesh car = make_car(size_m);
  std::set<float> heights_at_full_length;
  for (const glm::vec3& p : car.positions_m) {
    if (std::abs(std::abs(double{p.x}) - 0.5 * size_m.x) < 1e-5) heights_at_full_length.insert(p.z);
  }
  ASSERT_EQ(heights_at_full_length.size(), 2U);
  EXPECT_NEAR(*heights_at_full_length.begin(), -0.5 * size_m.z, 1e-5);
  EXPECT_NEAR(*heights_at_full_length.rbegin(), top_m, 1e-5);
}

}  // namespace
}  // namespace hil::modules
