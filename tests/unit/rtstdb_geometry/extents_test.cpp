#include "rtstdb/geometry/extents.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace rtstdb {
namespace {

class Directions {
 public:
  glm::dvec3 next() {
    glm::dvec3 direction;
    do {
      direction = {normal_(engine_), normal_(engine_), normal_(engine_)};
    } while (glm::length(direction) < 1e-3);
    // Some along an axis, an edge or a diagonal.
    const auto kind = engine_() % 8;
    if (kind == 1) direction.x = 0.0;
    if (kind == 2) direction.y = direction.z;
    if (kind == 3) direction = {0.0, 0.0, direction.z};
    if (kind == 4) direction = {direction.x, -direction.x, direction.x};
    return direction;
  }

 private:
  std::mt19937_64 engine_{1};
  std::normal_distribution<double> normal_;
};

/// Each corner of the bounds of a triangle, from the middle of the mesh's bounds.
template <class Visit>
void visit_bounds(const TriangleMesh& mesh, const Bounds& bounds, const Visit& visit) {
  const glm::dvec3 middle_m = 0.5 * (glm::dvec3(bounds.minimum_m) + glm::dvec3(bounds.maximum_m));
  for (const glm::uvec3& triangle : mesh.triangles) {
    const Bounds triangle_bounds = bounds_of({mesh.positions_m, {triangle}});
    for (int corner = 0; corner < 8; ++corner) {
      const glm::vec3 at_m(corner & 1 ? triangle_bounds.maximum_m.x : triangle_bounds.minimum_m.x,
                           corner & 2 ? triangle_bounds.maximum_m.y : triangle_bounds.minimum_m.y,
                           corner & 4 ? triangle_bounds.maximum_m.z : triangle_bounds.minimum_m.z);
      visit(glm::dvec3(at_m) - middle_m);
    }
  }
}

double exact_extent(const TriangleMesh& mesh, const Bounds& bounds, const glm::dvec3& u) {
  double extent = -1e300;
  visit_bounds(mesh, bounds, [&](const glm::dvec3& p_m) { extent = std::max(extent, glm::dot(u, p_m)); });
  return extent;
}

TriangleMesh moved(TriangleMesh mesh, const glm::vec3& by_m) {
  for (glm::vec3& position_m : mesh.positions_m)
    position_m += by_m;
  return mesh;
}

std::vector<TriangleMesh> meshes() {
  std::mt19937_64 engine(2);
  std::normal_distribution<float> normal;
  TriangleMesh soup;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const glm::vec3 center(normal(engine), normal(engine), normal(engine));
    for (int corner = 0; corner < 3; ++corner)
      soup.positions_m.push_back(center + 0.1f * glm::vec3(normal(engine), normal(engine), normal(engine)));
    soup.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  const TriangleMesh slanted{{{0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f}, {2.0f, 2.0f, 2.1f}}, {{0, 1, 2}}};
  return {make_sphere(1.0, 3),
          make_cylinder(0.5, 4.0, 33),
          make_rectangle(2.0, 3.0),
          soup,
          slanted,
          moved(make_sphere(1.0, 2), {1e5f, -3e4f, 7.0f})};
}

TEST(Extents, HaveTheBoundsOfTheMesh) {
  for (const TriangleMesh& mesh : meshes()) {
    const Bounds expected = bounds_of(mesh);
    const Bounds bounds = extents_of(mesh).bounds;
    EXPECT_EQ(bounds.minimum_m, expected.minimum_m);
    EXPECT_EQ(bounds.maximum_m, expected.maximum_m);
  }
}

TEST(Extents, AreNotExceeded) {
  Directions directions;
  for (const TriangleMesh& mesh : meshes()) {
    const Extents extents = extents_of(mesh);
    for (int k = 0; k < 300; ++k) {
      const glm::dvec3 u = directions.next();
      EXPECT_LE(exact_extent(mesh, extents.bounds, u), extent_along(extents, u))
          << u.x << " " << u.y << " " << u.z;
    }
  }
}

TEST(Extents, AreExactInTheirDirections) {
  for (const TriangleMesh& mesh : meshes()) {
    const Extents extents = extents_of(mesh);
    const glm::vec3 far_m = glm::max(glm::abs(extents.bounds.minimum_m), glm::abs(extents.bounds.maximum_m));
    const double rounding_m = 1e-6 * static_cast<double>(far_m.x + far_m.y + far_m.z);
    for (int code = 0; code < 27; ++code) {
      const glm::dvec3 u(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
      EXPECT_NEAR(exact_extent(mesh, extents.bounds, u), extent_along(extents, u), rounding_m) << code;
    }
  }
}

TEST(Extents, OfASphereAreAtMostAnEighthTooLarge) {
  const Extents extents = extents_of(make_sphere(1.0, 6));
  Directions directions;
  double largest = 0.0;
  for (int k = 0; k < 10'000; ++k)
    largest = std::max(largest, extent_along(extents, glm::normalize(directions.next())));
  EXPECT_LT(largest, 1.14);
  const glm::dvec3 worst(1.0, std::sqrt(2.0) - 1.0, std::sqrt(3.0) - std::sqrt(2.0));
  EXPECT_NEAR(extent_along(extents, glm::normalize(worst)), glm::length(worst), 0.01);
}

TEST(Extents, OfABoxAreExact) {
  const TriangleMesh box = moved(make_box({1.0, 2.0, 5.0}), {0.25f, -3.0f, 8.0f});
  Directions directions;
  for (const Extents& extents : {extents_of(box), extents_of(bounds_of(box))}) {
    for (int k = 0; k < 1'000; ++k) {
      const glm::dvec3 u = directions.next();
      EXPECT_NEAR(extent_along(extents, u), glm::dot(glm::abs(u), glm::dvec3(0.5, 1.0, 2.5)),
                  2e-5 * glm::length(u));
    }
  }
}

TEST(Extents, OfASlantedMeshAreFarBelowThoseOfItsBounds) {
  const TriangleMesh slanted = meshes()[4];
  const glm::dvec3 across(1.0, -1.0, 0.0);
  const Extents extents = extents_of(slanted);
  EXPECT_NEAR(extent_along(extents_of(extents.bounds), across), 2.0, 1e-5);
  EXPECT_NEAR(extent_along(extents, across), 2.0, 1e-5) << "one triangle counts by its bounds";
  TriangleMesh fine;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const glm::vec3 at_m(0.02f * static_cast<float>(i));
    fine.positions_m.insert(fine.positions_m.end(),
                            {at_m, at_m + 0.01f, at_m + glm::vec3(0.02f, 0.02f, 0.021f)});
    fine.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  EXPECT_NEAR(extent_along(extents_of(fine), across), 0.02, 1e-3);
}

}  // namespace
}  // namespace rtstdb
