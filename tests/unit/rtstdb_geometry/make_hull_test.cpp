// Hulls of random and degenerate sets of points, with exact signs in 128-bit integers.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/orientation.hpp"
#include "rtstdb/geometry/ulp.hpp"
#include "tests/support/random.hpp"

namespace rtstdb {
namespace {

__extension__ using Wide = __int128;
using Points = std::vector<glm::vec3>;

using test::Random;

/// A point in a cube around the origin.
glm::dvec3 in_cube(Random& random) {
  const double x = random.uniform(-1.0, 1.0);
  const double y = random.uniform(-1.0, 1.0);
  return {x, y, random.uniform(-1.0, 1.0)};
}

using Grid = std::array<std::int64_t, 3>;

/// Coordinates that are multiples of 2^-shift, as integers.
std::vector<Grid> on_grid(const Points& points_m, int shift) {
  std::vector<Grid> grid;
  for (const glm::vec3& p : points_m)
    grid.push_back({std::llround(std::ldexp(static_cast<double>(p.x), shift)),
                    std::llround(std::ldexp(static_cast<double>(p.y), shift)),
                    std::llround(std::ldexp(static_cast<double>(p.z), shift))});
  return grid;
}

/// The sign of the determinant for coordinates below 2^31.
int exact_side(const Grid& a, const Grid& b, const Grid& c, const Grid& d) {
  const auto offset = [&](const Grid& p, std::size_t axis) { return static_cast<Wide>(p[axis] - a[axis]); };
  const auto cross = [&](std::size_t y, std::size_t z) {
    return offset(b, y) * offset(c, z) - offset(b, z) * offset(c, y);
  };
  const Wide product = cross(1, 2) * offset(d, 0) + cross(2, 0) * offset(d, 1) + cross(0, 1) * offset(d, 2);
  return product > 0 ? 1 : product < 0 ? -1 : 0;
}

/// A set of points whose coordinates are multiples of 2^-shift.
struct PointSet {
  std::string name;
  Points points_m;
  int shift = 0;
};

/// Rounds points of sizes up to 2^exponent to coordinates that exact_side takes.
PointSet rounded(std::string name, const std::vector<glm::dvec3>& points_m, int exponent) {
  PointSet set{std::move(name), {}, 30 - exponent};
  for (const glm::dvec3& p : points_m) {
    glm::vec3 q;
    for (int axis = 0; axis < 3; ++axis)
      q[axis] = static_cast<float>(std::ldexp(std::nearbyint(std::ldexp(p[axis], set.shift)), -set.shift));
    set.points_m.push_back(q);
  }
  return set;
}

std::vector<glm::dvec3> box_corners(const glm::dvec3& half_m) {
  std::vector<glm::dvec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1 ? 1 : -1) * half_m.x, (i & 2 ? 1 : -1) * half_m.y,
                         (i & 4 ? 1 : -1) * half_m.z);
  return corners;
}

std::vector<glm::dvec3> moved(std::vector<glm::dvec3> points, const glm::dquat& q, const glm::dvec3& by) {
  for (glm::dvec3& p : points)
    p = by + q * p;
  return points;
}

void repeat_some(Random& random, std::vector<glm::dvec3>& points) {
  const std::size_t count = points.size();
  for (std::size_t i = 0; i < count; ++i)
    points.insert(points.begin() + random.integer(0, static_cast<int>(points.size())),
                  points[random.below(count)]);
}

constexpr int kinds = 10;

PointSet random_set(Random& random, int kind) {
  std::vector<glm::dvec3> points;
  switch (kind) {
    case 0:  // a rotated cube; each corner several times, or not all of them
      points = moved(box_corners(glm::dvec3(0.5)), random.orientation(), {});
      if (random.integer(0, 1) == 0) repeat_some(random, points);
      return rounded("rotated cube", points, 1);
    case 1:  // a box of any aspect up to 10^4
      points = moved(box_corners({0.5, 0.5 * random.magnitude(1e-4, 1.0), 0.5 * random.magnitude(1e-4, 1.0)}),
                     random.orientation(), {});
      return rounded("plate or needle", points, 1);
    case 2: {  // a prism, with points on its edges and in its faces
      const int sides = random.integer(3, 12);
      const double height = random.magnitude(1e-3, 1.0);
      for (int i = 0; i < sides; ++i)
        for (const double z : {-0.5, 0.0, 0.5})
          points.emplace_back(0.7 * std::cos(6.2831853 * i / sides), 0.7 * std::sin(6.2831853 * i / sides),
                              z * height);
      return rounded("prism", moved(points, random.orientation(), {}), 1);
    }
    case 3:  // points of a lattice
      for (int i = random.integer(8, 60); i-- > 0;)
        points.emplace_back(random.integer(-2, 2), random.integer(-2, 2), random.integer(-2, 2));
      return rounded("lattice", points, 2);
    case 4: {  // nearly coplanar
      const double thickness = random.magnitude(1e-8, 1e-2);
      for (int i = random.integer(6, 40); i-- > 0;)
        points.emplace_back(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5),
                            thickness * random.uniform(-0.5, 0.5));
      return rounded("nearly coplanar", moved(points, random.orientation(), {}), 1);
    }
    case 5:  // a sphere, each point several times
      for (int i = random.integer(4, 40); i-- > 0;)
        points.push_back(random.direction());
      repeat_some(random, points);
      return rounded("sphere", points, 1);
    case 6:  // random points
      for (int i = random.integer(4, 40); i-- > 0;)
        points.push_back(in_cube(random));
      return rounded("cloud", points, 1);
    case 7:  // 100 km away, where rounding moves points by a share of the size
      for (int i = random.integer(4, 40); i-- > 0;)
        points.push_back(random.direction());
      return rounded("far sphere", moved(points, random.orientation(), 1e5 * random.direction()), 17);
    case 8:  // a rotated box with points on its edges and in its faces, far away
      for (int i = 0; i < 64; ++i)
        points.emplace_back(i % 4 / 3.0, i / 4 % 4 / 3.0, i / 16 / 3.0);
      return rounded("far grid", moved(points, random.orientation(), {3000.0, -1500.0, 100.0}), 12);
    default: {  // planes through many points, without rotation
      const double step = std::ldexp(1.0, -random.integer(1, 12));
      for (int i = random.integer(8, 80); i-- > 0;)
        points.push_back(step * glm::round(in_cube(random) / step));
      return rounded("rounded cloud", points, 1);
    }
  }
}

struct Thickness {
  double width_m = 0.0, limit_m = 0.0;
};

/// The least extent of the points along a normal of three of them.
Thickness thickness_of(const Points& points_m) {
  double width = std::numeric_limits<double>::infinity();
  std::vector<glm::dvec3> all;
  std::set<std::tuple<float, float, float>> known;
  for (const glm::vec3& p : points_m)
    if (known.emplace(p.x, p.y, p.z).second) all.emplace_back(p);
  for (std::size_t i = 2; i < all.size(); ++i) {
    for (std::size_t k = 1; k < i; ++k) {
      for (std::size_t j = 0; j < k; ++j) {
        const glm::dvec3 across = glm::cross(all[k] - all[j], all[i] - all[j]);
        if (glm::length(across) == 0.0) continue;
        const glm::dvec3 n = glm::normalize(across);
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (const glm::dvec3& p : all) {
          low = std::min(low, glm::dot(n, p - all[0]));
          high = std::max(high, glm::dot(n, p - all[0]));
          if (high - low > width) break;
        }
        width = std::min(width, high - low);
      }
    }
  }
  if (std::isinf(width)) width = 0.0;
  return {width, hull_tolerance_ulp * ulp_m(points_m)};
}

void expect_hull(const TriangleMesh& mesh, const PointSet& set) {
  const std::size_t n = mesh.positions_m.size();
  ASSERT_GE(n, 4u);
  ASSERT_LE(mesh.triangles.size(), 2 * n - 4);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const glm::uvec3& t : mesh.triangles)
    for (int i = 0; i < 3; ++i)
      ++edges[{t[i], t[(i + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_EQ(edges.count({edge.second, edge.first}), 1u) << "open";
  }
  const std::vector<Grid> at = on_grid(mesh.positions_m, set.shift);
  const std::vector<Grid> all = on_grid(set.points_m, set.shift);
  std::set<std::tuple<float, float, float>> given, corners;
  for (const glm::vec3& p : set.points_m)
    given.emplace(p.x, p.y, p.z);
  for (const glm::vec3& p : mesh.positions_m) {
    ASSERT_TRUE(given.contains({p.x, p.y, p.z}));
    ASSERT_TRUE(corners.emplace(p.x, p.y, p.z).second) << "a corner twice";
  }
  // Planes around each corner: with three different ones it is neither in a face nor in an edge.
  std::vector<std::vector<glm::uvec3>> around(n);
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::vec3 a = mesh.positions_m[t.x], b = mesh.positions_m[t.y], c = mesh.positions_m[t.z];
    ASSERT_NE(glm::cross(glm::dvec3(b) - glm::dvec3(a), glm::dvec3(c) - glm::dvec3(a)), glm::dvec3(0.0));
    for (const Grid& p : all)
      ASSERT_LE(exact_side(at[t.x], at[t.y], at[t.z], p), 0);
    for (int i = 0; i < 3; ++i) {
      auto& planes = around[t[i]];
      const bool is_new = std::ranges::none_of(planes, [&](const glm::uvec3& other) {
        for (int k = 0; k < 3; ++k)
          if (exact_side(at[t.x], at[t.y], at[t.z], at[other[k]]) != 0) return false;
        return true;
      });
      if (is_new) planes.push_back(t);
    }
  }
  for (const auto& planes : around)
    ASSERT_GE(planes.size(), 3u);
}

TEST(MakeHull, IsExactForRandomSets) {
  constexpr std::uint64_t seed = 7301;
  Random random(seed);
  int refused = 0;
  for (int i = 0; i < 12'000; ++i) {
    const PointSet set = random_set(random, i % kinds);
    SCOPED_TRACE(set.name + ", set " + std::to_string(i) + " of seed " + std::to_string(seed));
    const auto result = make_hull(set.points_m);
    if (result) {
      expect_hull(result.value(), set);
      if (HasFatalFailure()) return;
      // The hull of the hull is the hull.
      const auto again = make_hull(result.value().positions_m);
      ASSERT_TRUE(again);
      ASSERT_EQ(again.value().positions_m, result.value().positions_m);
    }
    if (!result || set.points_m.size() <= 12) {
      refused += result ? 0 : 1;
      const Thickness thickness = thickness_of(set.points_m);
      ASSERT_TRUE(result ? thickness.width_m >= 0.99 * thickness.limit_m
                         : thickness.width_m <= 1.01 * thickness.limit_m)
          << thickness.width_m << " m of " << thickness.limit_m << " m";
    }
  }
  EXPECT_GT(refused, 50);
  EXPECT_LT(refused, 2'000);
}

TEST(MakeHull, SignsAreExact) {
  constexpr std::uint64_t seed = 7302;
  Random random(seed);
  int coplanar = 0;
  for (int i = 0; i < 200'000; ++i) {
    // A point in the plane of three others, up to rounding.
    const glm::dvec3 a = 0.5 * in_cube(random), b = a + random.uniform(1e-6, 0.5) * in_cube(random),
                     c = a + random.uniform(1e-6, 0.5) * in_cube(random);
    const glm::dvec3 d = a + random.uniform(-1.0, 1.0) * (b - a) + random.uniform(-1.0, 1.0) * (c - a);
    const PointSet set = i % 2 == 0 ? rounded("", {a, b, c, d}, 1)
                                    : rounded("",
                                              {glm::round(64.0 * a) / 64.0, glm::round(64.0 * b) / 64.0,
                                               glm::round(64.0 * c) / 64.0, glm::round(64.0 * d) / 64.0},
                                              1);
    const auto& p = set.points_m;
    const std::vector<Grid> at = on_grid(p, set.shift);
    const int expected = exact_side(at[0], at[1], at[2], at[3]);
    ASSERT_EQ(OrientedPlane(p[0], p[1], p[2]).side_of(p[3]), expected) << i << " of seed " << seed;
    ASSERT_EQ(OrientedPlane(p[1], p[0], p[2]).side_of(p[3]), -expected);
    coplanar += expected == 0 ? 1 : 0;
  }
  EXPECT_GT(coplanar, 1'000);
  // Differences that are no doubles: the sign depends on the least number of single precision.
  constexpr float tiny = std::numeric_limits<float>::denorm_min();
  for (const float lift : {-tiny, 0.0f, tiny}) {
    const int expected = lift > 0.0f ? 1 : lift < 0.0f ? -1 : 0;
    EXPECT_EQ(OrientedPlane({1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {-1.0f, -1.0f, 0.0f})
                  .side_of({0.1f, 0.2f, lift}),
              expected);
    // In the plane x + y + z = 1 with one corner beside it.
    EXPECT_EQ(
        OrientedPlane({1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}).side_of({0.5f, 0.5f, lift}),
        expected);
  }
}

TEST(MakeHull, OfTheTrianglesOfASphereHasItsCorners) {
  const TriangleMesh sphere = make_sphere(1.0, 1);
  Points soup;
  for (const glm::uvec3& t : sphere.triangles)
    for (int i = 0; i < 3; ++i)
      soup.push_back(sphere.positions_m[t[i]]);
  const auto hull = make_hull(soup);
  ASSERT_TRUE(hull);
  EXPECT_EQ(hull.value().positions_m.size(), 42u);
  EXPECT_EQ(hull.value().triangles.size(), 80u);
}

TEST(MakeHull, RefusesWithNumbers) {
  const auto refusal = [](const Points& points_m) {
    const auto result = make_hull(points_m);
    EXPECT_FALSE(result);
    if (result) return std::string();
    EXPECT_EQ(result.error().code, ErrorCode::bad_input);
    return result.error().message;
  };
  EXPECT_EQ(refusal({}), "a hull of 0 points, which span no volume; at least 4 are needed");
  EXPECT_EQ(refusal({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}),
            "a hull of 3 points, which span no volume; at least 4 are needed");
  EXPECT_EQ(refusal({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, std::numeric_limits<float>::infinity(), 1}}),
            "a hull of 4 points, of which point 3 is (0, inf, 1); finite numbers are needed");
  const std::string of_thin = refusal({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.25f, 0.25f, 0x1p-22f}});
  EXPECT_EQ(of_thin,
            "a hull of 4 points that are too thin: they are 2.384e-07 m thick, and at least 4.768e-07 m are "
            "needed, which is 4 times the precision of their largest coordinate");
  EXPECT_NE(refusal(Points(100, {1.0f, 2.0f, 3.0f})).find("0 m thick"), std::string::npos);
  Points line;
  for (int i = 0; i < 50; ++i)
    line.emplace_back(0.1f * static_cast<float>(i), 0.2f * static_cast<float>(i),
                      0.3f * static_cast<float>(i));
  EXPECT_NE(refusal(line).find(" m thick"), std::string::npos);
  EXPECT_TRUE(make_hull(Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.25f, 0.25f, 0x1p-20f}}));
  const float large = std::numeric_limits<float>::max();
  EXPECT_TRUE(make_hull(Points{{-large, 0, 0}, {large, 0, 0}, {0, large, 0}, {0, 0, large}}));
}

}  // namespace
}  // namespace rtstdb
