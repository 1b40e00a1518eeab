// Normals and points of solids against closed forms: of spheres and capsules, and of cylinders where a cap,
// the line of the side, or a flat face of the other body touches.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "rtstdb/geometry/ulp.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

const glm::dvec3 up{0.0, 0.0, 1.0};

/// A rotation of `from` to `to`, and then by a random angle about that.
glm::dquat turn(Random& random, const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 axis = glm::cross(from, to);
  const double sine = glm::length(axis);
  const glm::dquat q = sine > 1e-12 ? glm::angleAxis(std::atan2(sine, glm::dot(from, to)), axis / sine)
                       : glm::dot(from, to) > 0.0
                           ? glm::dquat(1.0, 0.0, 0.0, 0.0)
                           : glm::angleAxis(std::numbers::pi, glm::dvec3(1.0, 0.0, 0.0));
  return glm::angleAxis(random.uniform(0.0, 6.28), to) * q;
}

glm::dvec3 across(Random& random, const glm::dvec3& n) {
  return glm::normalize(glm::cross(n, random.direction()));
}

/// Two bodies with a normal that a closed form gives.
struct TouchCase {
  EntityRow first, second;
  double distance_m = 0.0;
  glm::dvec3 n{0.0};  ///< from the second body to the first
  glm::dvec3 on_first_m{
      0.0};  ///< where the first body touches, or any point of the line or face in which it does
  bool has_point = false;  ///< on_first_m is the only point
  double radius_m = 0.0;
  double other_m = 0.0;  ///< largest coordinate of the other body
};

class SolidNormals : public DatabaseTest {
 protected:
  static constexpr std::size_t sizes = 6;

  struct Round {
    GeometryId id;
    double radius_m = 0.0, half_height_m = 0.0;
  };

  void SetUp() override {
    DatabaseTest::SetUp();
    open({.max_entities = 8192});
    Random random(40);
    const auto solid = [&](const TriangleMesh& mesh, const Solid& form) {
      GeometryOptions options;
      options.solid = form;
      const auto added = database().add_geometry(mesh, "solid", options);
      EXPECT_TRUE(added.ok()) << (added.ok() ? "" : added.error().message);
      return added.value();
    };
    for (std::size_t i = 0; i < sizes; ++i) {
      // Sizes that single precision represents: the solids have no others.
      const double radius_m = std::ldexp(std::floor(random.uniform(64.0, 128.0)), -static_cast<int>(4 + i));
      const double height_m = std::ldexp(std::floor(random.uniform(64.0, 256.0)), -static_cast<int>(4 + i));
      spheres_.push_back(
          {solid(make_sphere(radius_m), {.kind = SolidKind::sphere, .radius_m = radius_m}), radius_m, 0.0});
      std::vector<glm::vec3> ends_m;
      for (const glm::vec3& p : make_sphere(radius_m, 2).positions_m)
        for (const double side : {-0.5, 0.5})
          ends_m.push_back(p + glm::vec3(0.0f, 0.0f, static_cast<float>(side * height_m)));
      capsules_.push_back({solid(make_hull(ends_m).value(),
                                 {.kind = SolidKind::capsule, .radius_m = radius_m, .height_m = height_m}),
                           radius_m, 0.5 * height_m});
      cylinders_.push_back({solid(make_cylinder(radius_m, height_m),
                                  {.kind = SolidKind::cylinder, .radius_m = radius_m, .height_m = height_m}),
                            radius_m, 0.5 * height_m});
    }
    box_ = add(make_box({2.0, 2.0, 2.0}));
  }

  /// A box of these half edge lengths.
  EntityRow box(const glm::dvec3& half_m) {
    EntityRow row = row_of(box_, {0.0, 0.0, 0.0});
    row.scale = half_m;
    return row;
  }
  static EntityRow placed(const Round& round, const glm::dvec3& p_m, const glm::dquat& q) {
    EntityRow row = row_of(round.id, p_m);
    row.motion.q_world = q;
    return row;
  }
  const Round& one_of(Random& random, const std::vector<Round>& rounds) {
    return rounds[random.below(rounds.size())];
  }
  /// A distance of that body: near, touching, and deep, up to the radius.
  static double random_distance_m(Random& random, double radius_m) {
    return (random.one_in(2) ? 1.0 : -1.0) * radius_m * random.magnitude(1e-5, 0.3);
  }

  /// Runs random cases in random poses of both bodies together, and in both orders. Errors of normals may be
  /// `angle_rad`, or 4 ulp of the other body over the radius.
  void expect_normals(const std::function<TouchCase(Random&)>& make, double angle_rad) {
    constexpr std::uint32_t count = 300;
    const std::uint64_t batches = hil::tests::rounds(2, 50);
    for (std::uint64_t batch = 0; batch < batches; ++batch) {
      Random random(900 + batch);
      std::vector<TouchCase> cases;
      std::vector<EntityRow> rows;
      for (std::uint32_t i = 0; i < count; ++i) {
        TouchCase touch = make(random);
        const glm::dquat q = random.one_in(2) ? random.orientation() : glm::dquat(1.0, 0.0, 0.0, 0.0);
        const glm::dvec3 by_m = random.one_in(4) ? glm::dvec3(8e4, -8e4, 8e4) : glm::dvec3(0.0);
        for (EntityRow* row : {&touch.first, &touch.second}) {
          row->motion.p_world_m = by_m + q * row->motion.p_world_m;
          row->motion.q_world = q * row->motion.q_world;
        }
        touch.n = q * touch.n;
        touch.on_first_m = by_m + q * touch.on_first_m;
        cases.push_back(touch);
        rows.insert(rows.end(), {touch.first, touch.second});
      }
      const std::vector<EntityId> entities = create(rows);
      const auto query = prepare(ContactQueryOptions{
          .name = "solids", .capacity = 2 * count, .pairs_per_search = 1, .max_bodies = 1});
      ASSERT_NE(query, nullptr);
      for (std::uint32_t i = 0; i < count; ++i)
        for (std::uint32_t swapped = 0; swapped < 2; ++swapped)
          query->searches()[2 * i + swapped] = {.first = entities[2 * i + swapped],
                                                .second = entities[2 * i + 1 - swapped],
                                                .margin_m = static_cast<float>(cases[i].radius_m)};
      const Outcome outcome = run(*query, 2 * count);
      ASSERT_TRUE(outcome.done()) << describe(outcome);
      double worst_rad = 0.0;
      for (std::uint32_t i = 0; i < 2 * count; ++i) {
        const TouchCase& expected = cases[i / 2];
        const double sign = i % 2 == 0 ? 1.0 : -1.0;
        const ContactPair& found = query->answers()[i].pairs[0];
        SCOPED_TRACE(testing::Message() << "batch " << batch << ", pair " << i << ", distance "
                                        << expected.distance_m << " m, radius " << expected.radius_m << " m");
        ASSERT_EQ(found.status, expected.distance_m > 0.0 ? PairStatus::near : PairStatus::contact);
        const double other_ulp_m = ulp_m(expected.other_m);
        EXPECT_NEAR(static_cast<double>(found.distance_m), expected.distance_m,
                    2e-6 * expected.radius_m + 4.0 * other_ulp_m);
        const double off_rad = glm::length(glm::cross(glm::dvec3(found.n_world), sign * expected.n));
        EXPECT_GT(glm::dot(glm::dvec3(found.n_world), sign * expected.n), 0.0);
        EXPECT_LE(off_rad, std::max(angle_rad, 4.0 * other_ulp_m / expected.radius_m));
        worst_rad = std::max(worst_rad, off_rad);
        ASSERT_GE(found.point_count, 1u);
        const glm::dvec3 first_m = (i % 2 == 0 ? expected.first : expected.second).motion.p_world_m;
        const glm::dvec3 at_m = first_m + glm::dvec3(found.points[0].p_first_m);
        const glm::dvec3 middle_m = expected.on_first_m - 0.5 * expected.distance_m * expected.n;
        const double allowed_m = 1e-4 * expected.radius_m + 8.0 * other_ulp_m;
        EXPECT_NEAR(glm::dot(at_m - middle_m, expected.n), 0.0, allowed_m);
        if (expected.has_point) {
          EXPECT_LE(glm::distance(at_m, middle_m), allowed_m);
        }
      }
      RecordProperty("worst_angle_nrad", static_cast<int>(1e9 * worst_rad));
      for (const EntityId entity : entities)
        remove(entity, {});
    }
  }

  GeometryId box_;
  std::vector<Round> spheres_, capsules_, cylinders_;
};

TEST_F(SolidNormals, OfSpheresOnFlatFaces) {
  expect_normals(
      [&](Random& random) {
        const Round& ball = one_of(random, spheres_);
        const bool is_deep = random.one_in(4);  // its centre is in the box
        const double d_m =
            is_deep ? -random.uniform(1.0, 1.8) * ball.radius_m : random_distance_m(random, ball.radius_m);
        const double half_m = ball.radius_m * random.magnitude(is_deep ? 40.0 : 2.0, 1e3);
        const glm::dvec3 on_face_m(random.uniform(-0.9, 0.9) * half_m, random.uniform(-0.9, 0.9) * half_m,
                                   half_m);
        return TouchCase{.first = placed(ball, on_face_m + (ball.radius_m + d_m) * up, random.orientation()),
                         .second = box({half_m, half_m, half_m}),
                         .distance_m = d_m,
                         .n = up,
                         .on_first_m = on_face_m + d_m * up,
                         .has_point = true,
                         .radius_m = ball.radius_m,
                         .other_m = half_m};
      },
      1e-6);
}

TEST_F(SolidNormals, OfSpheresOnCornersAndEdges) {
  expect_normals(
      [&](Random& random) {
        const Round& ball = one_of(random, spheres_);
        const double d_m = random_distance_m(random, ball.radius_m);
        const double half_m = ball.radius_m * random.magnitude(0.5, 10.0);
        glm::dvec3 n = glm::abs(random.direction()), at_m(half_m);
        if (random.one_in(2)) {
          n = glm::normalize(glm::dvec3(n.x, n.y, 0.0));
          at_m.z *= random.uniform(-0.9, 0.9);
        }
        return TouchCase{.first = placed(ball, at_m + (ball.radius_m + d_m) * n, random.orientation()),
                         .second = box(glm::dvec3(half_m)),
                         .distance_m = d_m,
                         .n = n,
                         .on_first_m = at_m + d_m * n,
                         .has_point = true,
                         .radius_m = ball.radius_m,
                         .other_m = half_m};
      },
      1e-5);
}

TEST_F(SolidNormals, OfSpheresAndCapsulesOnEachOther) {
  expect_normals(
      [&](Random& random) {
        const Round& first = one_of(random, random.one_in(2) ? spheres_ : capsules_);
        const Round& second = one_of(random, capsules_);
        const double radius_m = std::min(first.radius_m, second.radius_m);
        const double d_m = random_distance_m(random, radius_m);
        const glm::dvec3 n = random.direction();
        const glm::dvec3 along = across(random, n), other_along = across(random, n);
        const glm::dvec3 center_m = (first.radius_m + second.radius_m + d_m) * n +
                                    random.uniform(-0.9, 0.9) * first.half_height_m * along;
        const glm::dvec3 on_axis_m = random.uniform(-0.9, 0.9) * second.half_height_m * other_along;
        return TouchCase{
            .first = placed(first, center_m, turn(random, up, along)),
            .second = placed(second, on_axis_m, turn(random, up, other_along)),
            .distance_m = d_m,
            .n = n,
            .on_first_m = (second.radius_m + d_m) * n,
            .has_point = glm::length(glm::cross(along, other_along)) > 0.02 || first.half_height_m == 0.0,
            .radius_m = radius_m,
            .other_m = std::max(second.half_height_m, first.half_height_m) + radius_m};
      },
      1e-5);
}

/// The pose of a cylinder or a capsule that lies on a plane, stands on it, or touches it with its rim.
TEST_F(SolidNormals, OfCylindersAndCapsulesOnFlatFaces) {
  expect_normals(
      [&](Random& random) {
        const bool is_cylinder = !random.one_in(3);
        const Round& round = one_of(random, is_cylinder ? cylinders_ : capsules_);
        const double d_m = random_distance_m(random, std::min(round.radius_m, round.half_height_m));
        const double half_m = 4.0 * (round.radius_m + round.half_height_m) * random.magnitude(1.0, 100.0);
        const std::size_t kind = random.below(3);
        const double slope = random.uniform(0.1, 0.95);
        const glm::dvec3 along = kind == 0 ? across(random, up)
                                 : kind == 1
                                     ? (random.one_in(2) ? up : -up)
                                     : slope * up + std::sqrt(1.0 - slope * slope) * across(random, up);
        const double sine = std::sqrt(std::max(0.0, 1.0 - along.z * along.z));
        const double reach_m =
            round.half_height_m * std::abs(along.z) + round.radius_m * (is_cylinder ? sine : 1.0);
        const glm::dvec3 center_m(0.1 * half_m, -0.2 * half_m, half_m + reach_m + d_m);
        return TouchCase{.first = placed(round, center_m, turn(random, up, along)),
                         .second = box({half_m, half_m, half_m}),
                         .distance_m = d_m,
                         .n = up,
                         .on_first_m = center_m - reach_m * up,
                         .radius_m = round.radius_m,
                         .other_m = half_m};
      },
      1e-6);
}

TEST_F(SolidNormals, OfCapsAndSidesOfCylindersOnCornersAndEdges) {
  expect_normals(
      [&](Random& random) {
        const Round& round = one_of(random, cylinders_);
        const double d_m = random_distance_m(random, 0.3 * std::min(round.radius_m, round.half_height_m));
        const double half_m = round.radius_m * random.magnitude(1.0, 10.0);
        const bool is_cap = random.one_in(2), is_edge = random.one_in(2);
        glm::dvec3 n = glm::abs(random.direction()) + glm::dvec3(0.2);
        glm::dvec3 at_m(half_m);
        if (is_edge) {
          n.z = 0.0;
          at_m.z = random.uniform(-0.5, 0.5) * half_m;
        }
        n = glm::normalize(n);
        // Across the edge by more than a little, so that the side does not lie along it.
        glm::dvec3 along = across(random, n);
        while (is_edge && std::abs(along.z) > 0.9)
          along = across(random, n);
        const glm::dvec3 axis = is_cap ? n : along;
        const double reach_m = is_cap ? round.half_height_m : round.radius_m;
        const glm::dvec3 aside_m = is_cap ? random.uniform(0.0, 0.5) * round.radius_m * across(random, n)
                                          : random.uniform(-0.8, 0.8) * round.half_height_m * along;
        return TouchCase{.first = placed(round, at_m + (reach_m + d_m) * n + aside_m, turn(random, up, axis)),
                         .second = box(glm::dvec3(half_m)),
                         .distance_m = d_m,
                         .n = n,
                         .on_first_m = at_m + d_m * n,
                         .has_point = !(is_cap && is_edge),
                         .radius_m = round.radius_m,
                         .other_m = half_m};
      },
      1e-5);
}

TEST_F(SolidNormals, OfCylindersThatCross) {
  expect_normals(
      [&](Random& random) {
        const Round& first = one_of(random, cylinders_);
        const Round& second = one_of(random, random.one_in(2) ? cylinders_ : capsules_);
        const double radius_m = std::min(first.radius_m, second.radius_m);
        const double d_m = random_distance_m(random, 0.3 * radius_m);
        const glm::dvec3 n = random.direction();
        const glm::dvec3 along = across(random, n);
        glm::dvec3 other_along = across(random, n);
        while (std::abs(glm::dot(along, other_along)) > 0.9)
          other_along = across(random, n);
        return TouchCase{
            .first = placed(first,
                            (first.radius_m + second.radius_m + d_m) * n +
                                random.uniform(-0.8, 0.8) * first.half_height_m * along,
                            turn(random, up, along)),
            .second = placed(second, random.uniform(-0.8, 0.8) * second.half_height_m * other_along,
                             turn(random, up, other_along)),
            .distance_m = d_m,
            .n = n,
            .on_first_m = (second.radius_m + d_m) * n,
            .has_point = true,
            .radius_m = radius_m,
            .other_m = std::max(first.half_height_m, second.half_height_m) + radius_m};
      },
      1e-5);
}

/// An ellipsoid on a plane: the lowest point of the scaled sphere.
TEST_F(SolidNormals, OfEllipsoidsOnFlatFaces) {
  expect_normals(
      [&](Random& random) {
        const Round& ball = one_of(random, spheres_);
        EntityRow row = placed(ball, {0.0, 0.0, 0.0}, random.orientation());
        row.scale =
            glm::dvec3(random.magnitude(0.3, 3.0), random.magnitude(0.3, 3.0), random.magnitude(0.3, 3.0));
        const glm::dvec3 down = row.scale * (glm::conjugate(row.motion.q_world) * -up);
        const glm::dvec3 lowest_m = row.motion.q_world * (row.scale * (ball.radius_m * glm::normalize(down)));
        const double d_m = random_distance_m(random, 0.3 * ball.radius_m);
        const double half_m = ball.radius_m * random.magnitude(8.0, 100.0);
        const glm::dvec3 at_m(0.1 * half_m, 0.2 * half_m, half_m);
        row.motion.p_world_m = at_m + d_m * up - lowest_m;
        return TouchCase{.first = row,
                         .second = box({half_m, half_m, half_m}),
                         .distance_m = d_m,
                         .n = up,
                         .on_first_m = at_m + d_m * up,
                         .has_point = true,
                         .radius_m = ball.radius_m,
                         .other_m = half_m};
      },
      1e-5);
}

}  // namespace
}  // namespace rtstdb::test
