// Which meshes are convex: the database and the oracle, which use different algorithms, on random meshes.

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/convex_hull.hpp"
#include "rtstdb/geometry/ulp.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/surface_body.hpp"
#include "scene.hpp"
#include "tests/support/hull_meshes.hpp"

namespace rtstdb::oracle {
namespace {

/// A mesh in double precision, which is rounded where it is placed.
struct Shape {
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> triangles;
};

Shape shape_of(const TriangleMesh& mesh) {
  Shape shape{{}, mesh.triangles};
  for (const glm::vec3& p : mesh.positions_m)
    shape.corners.emplace_back(p);
  return shape;
}

/// A prism over a polygon, whose triangles are given; the upper end may be turned.
Shape prism(const std::vector<glm::dvec2>& polygon, const std::vector<glm::uvec3>& caps, double height,
            double turn_rad = 0.0) {
  Shape shape;
  const auto n = static_cast<std::uint32_t>(polygon.size());
  for (const bool up : {false, true}) {
    const double angle = up ? turn_rad : 0.0;
    for (const glm::dvec2& p : polygon)
      shape.corners.emplace_back(std::cos(angle) * p.x - std::sin(angle) * p.y,
                                 std::sin(angle) * p.x + std::cos(angle) * p.y, up ? height : 0.0);
  }
  for (const glm::uvec3& t : caps) {
    shape.triangles.push_back(t + n);
    shape.triangles.emplace_back(t.x, t.z, t.y);
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t k = (i + 1) % n;
    shape.triangles.emplace_back(i, k, k + n);
    shape.triangles.emplace_back(i, k + n, i + n);
  }
  return shape;
}

Shape regular_prism(int sides, double height, double turn_rad = 0.0) {
  std::vector<glm::dvec2> polygon;
  std::vector<glm::uvec3> caps;
  for (int i = 0; i < sides; ++i) {
    polygon.emplace_back(std::cos(6.283185307 * i / sides), std::sin(6.283185307 * i / sides));
    if (i > 1) caps.emplace_back(0, i - 1, i);
  }
  return prism(polygon, caps, height, turn_rad);
}

/// A rectangle of width 2 with a notch at a corner, of this width and depth.
Shape l_prism(double notch_x, double notch_y, double height) {
  return prism({{0, 0}, {2, 0}, {2, 2 - notch_y}, {2 - notch_x, 2 - notch_y}, {2 - notch_x, 2}, {0, 2}},
               {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}, height);
}

Shape u_prism(double notch, double height) {
  return prism({{0, 0}, {3, 0}, {3, 2}, {2, 2}, {2, 2 - notch}, {1, 2 - notch}, {1, 2}, {0, 2}},
               {{0, 1, 4}, {1, 2, 3}, {1, 3, 4}, {0, 4, 5}, {0, 5, 7}, {5, 6, 7}}, height);
}

/// A box whose top has a corner in its middle, at a depth below it.
Shape dented_box(const glm::dvec3& size, double depth) {
  Shape shape = shape_of(make_box(size));
  std::vector<glm::uvec3> triangles;
  const auto middle = static_cast<std::uint32_t>(shape.corners.size());
  for (const glm::uvec3& t : shape.triangles) {
    const auto top = [&](int i) { return shape.corners[t[i]].z > 0.0; };
    if (!(top(0) && top(1) && top(2))) {
      triangles.push_back(t);
      continue;
    }
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 a = shape.corners[t[i]], b = shape.corners[t[(i + 1) % 3]];
      if (a.x == b.x || a.y == b.y) triangles.emplace_back(t[i], t[(i + 1) % 3], middle);
    }
  }
  shape.corners.emplace_back(0.0, 0.0, 0.5 * size.z - depth);
  shape.triangles = std::move(triangles);
  return shape;
}

Shape together(Shape a, const Shape& b, const glm::dvec3& by) {
  const auto first = static_cast<std::uint32_t>(a.corners.size());
  for (const glm::dvec3& p : b.corners)
    a.corners.push_back(p + by);
  for (const glm::uvec3& t : b.triangles)
    a.triangles.push_back(t + first);
  return a;
}

/// Corners of triangles are no longer shared, and their order is random.
Shape soup_of(Random& random, const Shape& shape) {
  Shape soup;
  for (const glm::uvec3& t : shape.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.corners.size());
    soup.corners.insert(soup.corners.end(), {shape.corners[t.x], shape.corners[t.y], shape.corners[t.z]});
    soup.triangles.emplace_back(first, first + 1, first + 2);
  }
  std::shuffle(soup.triangles.begin(), soup.triangles.end(), std::mt19937_64(random.engine()));
  return soup;
}

struct Case {
  std::string name;
  Shape shape;
  std::optional<bool> convex{};  ///< empty: near the tolerance
};

double length_of_diagonal(const Shape& shape) {
  glm::dvec3 minimum(1e300), maximum(-1e300);
  for (const glm::dvec3& p : shape.corners) {
    minimum = glm::min(minimum, p);
    maximum = glm::max(maximum, p);
  }
  return glm::length(maximum - minimum);
}

constexpr int kinds = 12;

Case random_case(Random& random, int kind) {
  const auto size = [&](double low, double high) { return random.magnitude(low, high); };
  const glm::dvec3 aspect{1.0, size(3e-4, 1.0), size(3e-4, 1.0)};
  const int sides = 3 + static_cast<int>(random.uniform(0.0, 9.0));
  switch (kind) {
    case 0:
      return {"box", shape_of(make_box(aspect)), true};
    case 1:
      return {"prism", regular_prism(sides, size(1e-3, 10.0)), true};
    case 2: {
      const auto corners = static_cast<std::uint32_t>(4 + random.uniform(0.0, 12.0));
      return {"hull", shape_of(test::make_random_hull(random.engine(), corners, aspect)), true};
    }
    case 3:
      return {"L", l_prism(size(1e-2, 1.9), size(1e-2, 1.9), size(1e-2, 3.0)), false};
    case 4:
      return {"U", u_prism(size(1e-2, 1.9), size(1e-2, 3.0)), false};
    case 5: {
      const Shape one = dented_box({2, 2, 1}, size(1e-7, 0.9));
      const double depth = 0.5 - one.corners.back().z;
      const double share = depth / (convex_tolerance * length_of_diagonal(one));
      Case test_case{"dented box", one};
      if (share < 0.6) test_case.convex = true;
      // The box of the turned mesh has up to 1.67 times the diagonal of this one, and rounding adds 0.4.
      if (share > 2.1) test_case.convex = false;
      return test_case;
    }
    case 6:
      return {"twisted prism", regular_prism(sides, 1.0, size(2e-2, 0.5)), false};
    case 7:
      return {"two boxes",
              together(shape_of(make_box(aspect)), shape_of(make_box(aspect)), {1.0 + size(1e-3, 3.0), 0, 0}),
              false};
    case 8: {
      Shape flat = shape_of(test::make_two_sided_rectangle(1.0, size(1e-2, 1.0)));
      return {"flat", flat, true};
    }
    case 9: {
      // A plate without thickness, with a notch.
      Shape flat = l_prism(size(1e-2, 1.9), size(1e-2, 1.9), 0.0);
      return {"flat L", flat, false};
    }
    case 10: {
      // Walls of both sides of a box without a top.
      Shape cup = shape_of(make_box({1.0, 1.0, size(1e-2, 1.0)}));
      std::erase_if(cup.triangles, [&](const glm::uvec3& t) {
        return cup.corners[t.x].z > 0.0 && cup.corners[t.y].z > 0.0 && cup.corners[t.z].z > 0.0;
      });
      for (std::size_t i = cup.triangles.size(); i-- > 0;)
        cup.triangles.emplace_back(cup.triangles[i].x, cup.triangles[i].z, cup.triangles[i].y);
      return {"cup without thickness", cup, false};
    }
    default: {
      Shape hull = shape_of(test::make_random_hull(random.engine(), 12, glm::dvec3(1.0)));
      const double share = size(1e-7, 0.5);
      hull.corners[static_cast<std::size_t>(random.uniform(0.0, 12.0))] *= 1.0 - share;
      return {"hull with a moved corner", hull};
    }
  }
}

TriangleMesh placed(const Shape& shape, double scale, const glm::dquat& q, const glm::dvec3& by,
                    bool inside_out) {
  TriangleMesh mesh{.triangles = shape.triangles};
  for (const glm::dvec3& p : shape.corners)
    mesh.positions_m.emplace_back(by + q * (scale * p));
  if (inside_out)
    for (glm::uvec3& t : mesh.triangles)
      std::swap(t.y, t.z);
  return mesh;
}

/// Near the tolerance rounding may decide, and the oracle divides triangles a limited number of times.
TEST(Convexity, OfTheDatabaseIsThatOfTheOracleWhereverTheMeshIs) {
  constexpr std::uint64_t seed = 7310;
  Random random(seed);
  int convex = 0, undecided = 0;
  for (int i = 0; i < 12'000; ++i) {
    const Case test_case = random_case(random, i % kinds);
    SCOPED_TRACE(test_case.name + ", mesh " + std::to_string(i) + " of seed " + std::to_string(seed));
    const Shape shape = random.uniform(0.0, 1.0) < 0.2 ? soup_of(random, test_case.shape) : test_case.shape;
    const double scale = random.magnitude(1e-3, 1e3);
    const double size = scale * length_of_diagonal(shape);
    // Rounding of coordinates moves a surface by less than 0.4 of the tolerance.
    const glm::dvec3 by = random.magnitude(1e-3, 8.0) * size * random.direction();
    const TriangleMesh mesh = placed(shape, scale, random.orientation(), by, random.uniform(0.0, 1.0) < 0.2);
    const bool of_database = convex_hull_of(mesh).has_value();
    if (test_case.convex) {
      ASSERT_EQ(of_database, *test_case.convex);
      ASSERT_EQ(is_convex(mesh), *test_case.convex);
    } else if (of_database != is_convex(mesh)) {
      ++undecided;
    }
    convex += of_database;
  }
  EXPECT_GT(convex, 3'000);
  EXPECT_LT(convex, 9'000);
  EXPECT_LE(undecided, 4);
}

/// At least 128 times as thick as the precision of their coordinates, 100 km away.
TEST(Convexity, OfFarBodiesIsThatOfNearOnes) {
  constexpr std::uint64_t seed = 7311;
  Random random(seed);
  for (int i = 0; i < 2'000; ++i) {
    const glm::dvec3 aspect{1.0, random.magnitude(0.1, 1.0), random.magnitude(0.1, 1.0)};
    const double notch = random.magnitude(0.2, 1.5);
    const Shape shapes[] = {shape_of(make_box(aspect)), regular_prism(3 + i % 9, aspect.y),
                            shape_of(test::make_random_hull(random.engine(), 4 + i % 12, aspect)),
                            l_prism(notch, random.magnitude(0.2, 1.5), aspect.y), u_prism(notch, aspect.y)};
    const int kind = i % 5;
    SCOPED_TRACE("kind " + std::to_string(kind) + ", mesh " + std::to_string(i));
    const TriangleMesh mesh = placed(shapes[kind], random.magnitude(10.0, 1e3), random.orientation(),
                                     9e4 * random.direction(), i % 2 == 1);
    ASSERT_EQ(convex_hull_of(mesh).has_value(), kind < 3);
    ASSERT_EQ(is_convex(mesh), kind < 3);
  }
}

/// Every corner of the mesh is within the tolerance of the hull that remains, and faces are convex polygons.
TEST(Convexity, HullsKeepTheirCorners) {
  constexpr std::uint64_t seed = 7312;
  Random random(seed);
  int hulls = 0;
  for (int i = 0; i < 6'000; ++i) {
    const Case test_case = random_case(random, i % 3);
    SCOPED_TRACE(test_case.name + ", mesh " + std::to_string(i) + " of seed " + std::to_string(seed));
    const double scale = random.magnitude(1e-2, 1e2);
    const glm::dvec3 by = random.magnitude(1e-3, 100.0) * scale * random.direction();
    const TriangleMesh mesh = placed(test_case.shape, scale, random.orientation(), by, false);
    const auto hull = convex_hull_of(mesh);
    ASSERT_TRUE(hull);
    const double allowed_m = hull_tolerance_ulp * ulp_m(mesh.positions_m);
    for (const glm::vec3& p : hull->corners_m)
      ASSERT_NE(std::ranges::find(mesh.positions_m, p), mesh.positions_m.end());
    if (hull->faces.size() == 2) continue;  // thinner than the tolerance
    ++hulls;
    // Along any direction the corners that remain reach as far as those of the mesh.
    const auto reach_m = [](const std::vector<glm::vec3>& points_m, const glm::dvec3& n,
                            const glm::vec3& from) {
      double max_m = -1e300;
      for (const glm::vec3& p : points_m)
        max_m = std::max(max_m, glm::dot(n, glm::dvec3(p) - glm::dvec3(from)));
      return max_m;
    };
    const glm::vec3 from = mesh.positions_m[0];
    const auto expect_reach = [&](const glm::dvec3& n) {
      ASSERT_LE(reach_m(mesh.positions_m, n, from), reach_m(hull->corners_m, n, from) + allowed_m);
    };
    for (const glm::uvec3& t : mesh.triangles) {
      const glm::dvec3 a(mesh.positions_m[t.x]), b(mesh.positions_m[t.y]), c(mesh.positions_m[t.z]);
      const glm::dvec3 across = glm::cross(b - a, c - a);
      if (glm::length(across) > 0.0) expect_reach(glm::normalize(across));
    }
    for (int k = 0; k < 50; ++k)
      expect_reach(random.direction());
    std::vector<std::uint32_t> named = hull->face_triangles;
    std::ranges::sort(named);
    named.erase(std::unique(named.begin(), named.end()), named.end());
    ASSERT_LE(named.size(), mesh.triangles.size());
    for (const ConvexHull::Face& face : hull->faces) {
      ASSERT_GE(face.corner_count, 3u);
      ASSERT_GE(face.triangle_count, 1u);
      const auto corner = [&](std::uint32_t k) {
        return glm::dvec3(hull->corners_m[hull->face_corners[face.first_corner + k % face.corner_count]]);
      };
      const glm::dvec3 n(face.normal);
      // The normal has single precision.
      const double slope_m = 3e-7 * scale * length_of_diagonal(test_case.shape);
      double low_m = 1e300, high_m = -1e300;
      for (std::uint32_t k = 0; k < face.corner_count; ++k) {
        low_m = std::min(low_m, glm::dot(n, corner(k) - corner(0)));
        high_m = std::max(high_m, glm::dot(n, corner(k) - corner(0)));
        const glm::dvec3 along = corner(k + 1) - corner(k);
        for (std::uint32_t j = 0; j < face.corner_count; ++j)
          ASSERT_GE(glm::dot(glm::cross(n, glm::normalize(along)), corner(j) - corner(k)),
                    -allowed_m - slope_m);
      }
      ASSERT_LE(high_m - low_m, 2.0 * allowed_m + slope_m);
      if (face.corner_count > 3) {
        ASSERT_LE(reach_m(hull->corners_m, n, glm::vec3(corner(0))), 2.0 * allowed_m + slope_m);
      }
    }
  }
  EXPECT_GT(hulls, 5'000);
}

}  // namespace
}  // namespace rtstdb::oracle
