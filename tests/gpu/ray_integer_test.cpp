// Random triangles and rays with small integer coordinates, so that many rays pass exactly through edges,
// corners and planes. Integer arithmetic decides here what a ray crosses.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

struct Integers {
  std::int64_t x, y, z;
};
Integers operator+(const Integers& a, const Integers& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
Integers operator-(const Integers& a, const Integers& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
std::int64_t dot(const Integers& a, const Integers& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
Integers cross(const Integers& a, const Integers& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
bool is_zero(const Integers& a) {
  return a.x == 0 && a.y == 0 && a.z == 0;
}
glm::vec3 metres(const Integers& a) {
  return {a.x, a.y, a.z};
}
Integers random_integers(Random& random, std::int64_t max) {
  const auto next = [&] { return static_cast<std::int64_t>(random.below(2 * max + 1)) - max; };
  const std::int64_t x = next(), y = next();
  return {x, y, next()};
}

struct Triangle {
  Integers a, b, c;  // in the world frame
  std::uint32_t number;
};

/// The rounding error of lambda in single precision.
double lambda_tolerance(double lambda) {
  return 1e-6 * std::max(1.0, lambda);
}

enum class Crossing : std::uint8_t {
  none,
  at_edge,   // or the ray begins in the plane
  in_plane,  // the ray lies in the triangle's plane
  inside
};
struct Intersection {
  Crossing kind;
  double lambda;
};

Intersection intersect(const Integers& from, const Integers& direction, const Triangle& triangle) {
  const Integers normal = cross(triangle.b - triangle.a, triangle.c - triangle.a);
  const std::int64_t slope = dot(normal, direction);
  const std::int64_t height = dot(normal, triangle.a - from);
  if (slope == 0) return {height == 0 ? Crossing::in_plane : Crossing::none, 0.0};
  if (height != 0 && (height < 0) != (slope < 0)) return {Crossing::none, 0.0};
  const auto side = [&](const Integers& p, const Integers& q) {
    return dot(direction, cross(p - from, q - from));
  };
  const auto [min, max] =
      std::minmax({side(triangle.a, triangle.b), side(triangle.b, triangle.c), side(triangle.c, triangle.a)});
  const double lambda = static_cast<double>(height) / static_cast<double>(slope);
  if (min < 0 && max > 0) return {Crossing::none, lambda};
  return {(min > 0 || max < 0) && height != 0 ? Crossing::inside : Crossing::at_edge, lambda};
}

struct IntegerRay {
  Integers from, direction;
};

class IntegerCoordinates : public DatabaseTest {
 protected:
  static constexpr std::uint32_t bodies = 6;

  void create_bodies(Random& random) {
    std::vector<EntityRow> rows;
    triangles_.clear();
    for (std::uint32_t body = 0; body < bodies; ++body) {
      const Integers place = random_integers(random, 2);
      TriangleMesh mesh;
      triangles_.emplace_back();
      for (auto left = 1 + random.below(20); left > 0;) {
        const Integers a = random_integers(random, 4), b = random_integers(random, 4),
                       c = random_integers(random, 4);
        if (is_zero(cross(b - a, c - a))) continue;
        --left;
        const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
        mesh.positions_m.insert(mesh.positions_m.end(), {metres(a), metres(b), metres(c)});
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        triangles_.back().push_back({a + place, b + place, c + place, first / 3});
      }
      rows.push_back(row_of(add(mesh), metres(place)));
    }
    ids_ = create(rows);
  }

  std::vector<Ray> random_rays(Random& random, std::size_t count) {
    integer_rays_.clear();
    std::vector<Ray> rays;
    while (rays.size() < count) {
      const IntegerRay ray{random_integers(random, 8), random_integers(random, 3)};
      if (is_zero(ray.direction)) continue;
      integer_rays_.push_back(ray);
      rays.push_back(ray_from(metres(ray.from), metres(ray.direction)));
    }
    return rays;
  }

  struct Expected {
    double nearest_inside = INFINITY;  ///< lambda of the nearest triangle that the ray must hit
    bool may_hit = false;
    Intersection hit{Crossing::none, 0.0};  ///< with the triangle of the answer
  };
  Expected expected_of(std::size_t ray, const RayHit& hit) const {
    Expected expected;
    for (std::uint32_t body = 0; body < bodies; ++body) {
      for (const Triangle& triangle : triangles_[body]) {
        const Intersection intersection =
            intersect(integer_rays_[ray].from, integer_rays_[ray].direction, triangle);
        expected.may_hit = expected.may_hit || intersection.kind != Crossing::none;
        if (intersection.kind == Crossing::inside)
          expected.nearest_inside = std::min(expected.nearest_inside, intersection.lambda);
        if (hit.entity == ids_[body] && hit.triangle == triangle.number) expected.hit = intersection;
      }
    }
    return expected;
  }

  void expect_nearest(const std::vector<RayHit>& hits) {
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const Expected expected = expected_of(i, hits[i]);
      if (hits[i].status != HitStatus::hit) {
        ASSERT_EQ(hits[i].status, HitStatus::miss);
        ASSERT_EQ(expected.nearest_inside, INFINITY) << "ray " << i << " misses a triangle that it crosses";
        continue;
      }
      ++hits_;
      ASSERT_NE(expected.hit.kind, Crossing::none)
          << "ray " << i << " hits a triangle that it does not cross";
      ASSERT_LE(hits[i].lambda, expected.nearest_inside + lambda_tolerance(hits[i].lambda))
          << "ray " << i << " hits behind the nearest triangle";
      if (expected.hit.kind == Crossing::in_plane)
        ++in_plane_;
      else
        ASSERT_NEAR(hits[i].lambda, expected.hit.lambda, lambda_tolerance(hits[i].lambda)) << "ray " << i;
    }
    ray_count_ += hits.size();
  }

  void expect_any(const std::vector<RayHit>& hits) {
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const Expected expected = expected_of(i, hits[i]);
      if (hits[i].status == HitStatus::hit)
        ASSERT_TRUE(expected.may_hit) << "ray " << i << " hits a triangle that it does not cross";
      else
        ASSERT_EQ(expected.nearest_inside, INFINITY) << "ray " << i << " misses a triangle that it crosses";
    }
  }

  std::vector<std::vector<Triangle>> triangles_;
  std::vector<EntityId> ids_;
  std::vector<IntegerRay> integer_rays_;
  std::size_t ray_count_ = 0, hits_ = 0, in_plane_ = 0;
};

TEST_F(IntegerCoordinates, GiveTheNearestCrossedTriangle) {
  for (const bool use_subgroup_kernels : {true, false}) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", subgroup kernels " << use_subgroup_kernels);
      open({}, {.use_subgroup_kernels = use_subgroup_kernels});
      Random random(seed);
      create_bodies(random);
      const std::vector<Ray> rays = random_rays(random, 8000);
      expect_nearest(trace(rays));
      const auto any = prepare_rays(RayMode::any);
      expect_any(trace(*any, rays));
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(hits_, ray_count_ / 5);
  EXPECT_LT(hits_, ray_count_ * 4 / 5);
  EXPECT_LT(in_plane_, hits_ / 200);
}

}  // namespace
}  // namespace rtstdb::test
