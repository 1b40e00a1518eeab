// Soups and rays of small whole numbers, where many a ray meets edges, corners and planes to the last bit:
// what a ray crosses is decided without rounding here.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

struct Whole {
  std::int64_t x, y, z;
};
Whole operator+(const Whole& a, const Whole& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
Whole operator-(const Whole& a, const Whole& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
std::int64_t dot(const Whole& a, const Whole& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
Whole cross(const Whole& a, const Whole& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
bool is_zero(const Whole& a) {
  return a.x == 0 && a.y == 0 && a.z == 0;
}
glm::vec3 metres(const Whole& a) {
  return {a.x, a.y, a.z};
}
Whole drawn_within(Random& random, std::int64_t most) {
  const auto one = [&] { return static_cast<std::int64_t>(random.below(2 * most + 1)) - most; };
  const std::int64_t x = one(), y = one();
  return {x, y, one()};
}

struct Corner3 {
  Whole a, b, c;  // in the world
  std::uint32_t triangle;
};

/// What single precision leaves of a lambda among these numbers.
double blur(double lambda) {
  return 1e-6 * std::max(1.0, lambda);
}

enum class Meeting : std::uint8_t {
  none,
  at_its_rim,  // or where the ray begins
  within,      // the ray runs in the triangle's plane
  crossing
};
struct Met {
  Meeting how;
  double lambda;
};

Met meet(const Whole& from, const Whole& direction, const Corner3& of) {
  const Whole normal = cross(of.b - of.a, of.c - of.a);
  const std::int64_t slope = dot(normal, direction);
  const std::int64_t height = dot(normal, of.a - from);
  if (slope == 0) return {height == 0 ? Meeting::within : Meeting::none, 0.0};
  if (height != 0 && (height < 0) != (slope < 0)) return {Meeting::none, 0.0};
  const auto side = [&](const Whole& p, const Whole& q) { return dot(direction, cross(p - from, q - from)); };
  const auto [least, most] = std::minmax({side(of.a, of.b), side(of.b, of.c), side(of.c, of.a)});
  const double lambda = static_cast<double>(height) / static_cast<double>(slope);
  if (least < 0 && most > 0) return {Meeting::none, lambda};
  return {(least > 0 || most < 0) && height != 0 ? Meeting::crossing : Meeting::at_its_rim, lambda};
}

struct Asked {
  Whole from, direction;
};

class WholeNumbers : public DatabaseTest {
 protected:
  static constexpr std::uint32_t bodies = 6;

  void strew(Random& random) {
    std::vector<EntityRow> rows;
    soups_.clear();
    for (std::uint32_t body = 0; body < bodies; ++body) {
      const Whole place = drawn_within(random, 2);
      TriangleMesh mesh;
      soups_.emplace_back();
      for (auto left = 1 + random.below(20); left > 0;) {
        const Whole a = drawn_within(random, 4), b = drawn_within(random, 4), c = drawn_within(random, 4);
        if (is_zero(cross(b - a, c - a))) continue;
        --left;
        const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
        mesh.positions_m.insert(mesh.positions_m.end(), {metres(a), metres(b), metres(c)});
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        soups_.back().push_back({a + place, b + place, c + place, first / 3});
      }
      rows.push_back(row_of(add(mesh), metres(place)));
    }
    ids_ = create(rows);
  }

  std::vector<Ray> draw(Random& random, std::size_t count) {
    asked_.clear();
    std::vector<Ray> rays;
    while (rays.size() < count) {
      const Asked one{drawn_within(random, 8), drawn_within(random, 3)};
      if (is_zero(one.direction)) continue;
      asked_.push_back(one);
      rays.push_back(ray_from(metres(one.from), metres(one.direction)));
    }
    return rays;
  }

  /// The nearest that the ray crosses, what it may hit at all, and how it meets what was hit.
  struct Judged {
    double nearest_crossed = INFINITY;
    bool meets_something = false;
    Met hit{Meeting::none, 0.0};
  };
  Judged judge_ray(std::size_t ray, const RayHit& hit) const {
    Judged judged;
    for (std::uint32_t body = 0; body < bodies; ++body) {
      for (const Corner3& triangle : soups_[body]) {
        const Met met = meet(asked_[ray].from, asked_[ray].direction, triangle);
        judged.meets_something = judged.meets_something || met.how != Meeting::none;
        if (met.how == Meeting::crossing)
          judged.nearest_crossed = std::min(judged.nearest_crossed, met.lambda);
        if (hit.entity == ids_[body] && hit.triangle == triangle.triangle) judged.hit = met;
      }
    }
    return judged;
  }

  void expect_nearest(const std::vector<RayHit>& hits) {
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const Judged judged = judge_ray(i, hits[i]);
      if (hits[i].status != HitStatus::hit) {
        ASSERT_EQ(hits[i].status, HitStatus::miss);
        ASSERT_EQ(judged.nearest_crossed, INFINITY) << "ray " << i << " missed what it crosses";
        continue;
      }
      ++hits_;
      ASSERT_NE(judged.hit.how, Meeting::none) << "ray " << i << " hit what it does not meet";
      ASSERT_LE(hits[i].lambda, judged.nearest_crossed + blur(hits[i].lambda))
          << "ray " << i << " went on behind";
      if (judged.hit.how == Meeting::within)
        ++within_;
      else
        ASSERT_NEAR(hits[i].lambda, judged.hit.lambda, blur(hits[i].lambda)) << "ray " << i;
    }
    asked_count_ += hits.size();
  }

  void expect_any(const std::vector<RayHit>& hits) {
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const Judged judged = judge_ray(i, hits[i]);
      if (hits[i].status == HitStatus::hit)
        ASSERT_TRUE(judged.meets_something) << "ray " << i << " hit what it does not meet";
      else
        ASSERT_EQ(judged.nearest_crossed, INFINITY) << "ray " << i << " missed what it crosses";
    }
  }

  std::vector<std::vector<Corner3>> soups_;
  std::vector<EntityId> ids_;
  std::vector<Asked> asked_;
  std::size_t asked_count_ = 0, hits_ = 0, within_ = 0;
};

TEST_F(WholeNumbers, NothingIsHitThatIsNotMetAndNothingNearerPassedBy) {
  for (const bool use_subgroup_kernels : {true, false}) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
      SCOPED_TRACE(testing::Message()
                   << "seed " << seed << ", lanes work together: " << use_subgroup_kernels);
      open({}, {.use_subgroup_kernels = use_subgroup_kernels});
      Random random(seed);
      strew(random);
      const std::vector<Ray> rays = draw(random, 8000);
      expect_nearest(trace(rays));
      const auto any = prepare_rays(RayMode::any);
      expect_any(trace(*any, rays));
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(hits_, asked_count_ / 5);
  EXPECT_LT(hits_, asked_count_ * 4 / 5);
  EXPECT_LT(within_, hits_ / 200);
}

}  // namespace
}  // namespace rtstdb::test
