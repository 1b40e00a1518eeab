#include <glm/ext/vector_double2.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "rtstdb/oracle/posed_cone.hpp"
#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

Cone cone_about(const Ray& ray, double opening_angle_rad) {
  Cone cone;
  cone.origin_m = ray.origin_m;
  cone.direction = ray.direction;
  cone.opening_angle_rad = static_cast<float>(opening_angle_rad);
  cone.lambda_max = ray.lambda_max;
  cone.t = ray.t;
  cone.mask = ray.mask;
  cone.carrier = ray.carrier;
  return cone;
}

Cone along_x(double opening_angle_rad) {
  return cone_about(ray_from({}, {1, 0, 0}), opening_angle_rad);
}

Cone random_cone(Random& random, const Scene& scene) {
  const double angle_rad = random.below(3) == 0 ? random.uniform(0.3, 3.0) : random.magnitude(1e-4, 0.3);
  return cone_about(random_ray(random, scene), angle_rad);
}

/// Of many points of the triangle in the space, none lies before the first one.
TEST(FirstPoint, IsTheFirstOfMany) {
  Random random(90);
  int met = 0;
  for (int i = 0; i < 2000; ++i) {
    ConeCorners c{};
    for (glm::dvec3& corner : c)
      corner = glm::dvec3(0.0, 0.0, 3.0) + 2.0 * random.vector();
    const ConeSpace space{random.magnitude(0.01, 5.0), 0.0, 0.0, 10.0};
    const auto first = first_point(c, space);
    double least = std::numeric_limits<double>::infinity();
    constexpr int steps = 60;
    for (int u = 0; u <= steps; ++u) {
      for (int v = 0; u + v <= steps; ++v) {
        const glm::dvec2 share = glm::dvec2(u, v) / double{steps};
        const glm::dvec3 p = c[0] + share.x * (c[1] - c[0]) + share.y * (c[2] - c[0]);
        if (p.z < 0.0 || p.z > space.z_max_m || std::hypot(p.x, p.y) > space.slope * p.z) continue;
        least = std::min(least, p.z);
      }
    }
    if (!first) {
      ASSERT_TRUE(std::isinf(least)) << "triangle " << i;
      continue;
    }
    ++met;
    ASSERT_LE(first->z, least + 1e-9) << "triangle " << i;
    ASSERT_LE(std::hypot(first->x, first->y), space.slope * first->z + 1e-9) << "triangle " << i;
    if (std::isinf(least)) continue;
    // The grid is that coarse, and the cone may cut off a thin part.
    ASSERT_GE(first->z, least - 2.0) << "triangle " << i;
  }
  EXPECT_GT(met, 400);
  EXPECT_LT(met, 1800);
}

TEST(ConeContacts, OfPlaneSphereAndEdge) {
  Scene scene;
  const double half_rad = 0.05;
  // A plane that is tilted by 45 degrees is met along the generator that is inclined towards it.
  Motion motion = at({10.0, 0.0, 0.0});
  motion.q_world = glm::angleAxis(0.25 * std::numbers::pi, glm::dvec3(0.0, 1.0, 0.0));
  scene.place(make_rectangle(40.0, 40.0), motion);
  auto contacts_of = [&](const Cone& cone) { return contacts(scene.world(), cone); };
  auto found = contacts_of(along_x(2.0 * half_rad));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].lambda, 10.0 / (1.0 + std::tan(half_rad)), 1e-7);

  Scene with_sphere;
  with_sphere.place(make_sphere(1.0, 6), at({20.0, 0.0, 0.0}));
  found = contacts(with_sphere.world(), along_x(0.2));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].lambda, 19.0, 1e-3);

  Scene with_box;
  with_box.place(make_box({2.0, 2.0, 2.0}), at({10.0, 1.5, 0.0}));
  // Its edge along the axis, half a metre beside it, is met where the cone is that wide.
  EXPECT_TRUE(contacts(with_box.world(), along_x(2.0 * std::atan(0.5 / 11.01))).empty());
  found = contacts(with_box.world(), along_x(2.0 * std::atan(0.5 / 10.0)));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].lambda, 10.0, 1e-6);
}

TEST(ConeContacts, TreesFindWhatAllTrianglesHave) {
  const Scene scene = crowd(91, 30);
  const World world = scene.world();
  Random random(92);
  std::size_t found = 0;
  for (int i = 0; i < 300; ++i) {
    const Cone cone = random_cone(random, scene);
    const auto faces = static_cast<Faces>(i % 3);
    const auto by_trees = contacts(world, cone, faces);
    const auto by_force = contacts_brute_force(world, cone, faces);
    ASSERT_EQ(by_trees.size(), by_force.size()) << "cone " << i;
    for (std::size_t k = 0; k < by_trees.size(); ++k) {
      EXPECT_EQ(by_trees[k].entity, by_force[k].entity);
      EXPECT_EQ(by_trees[k].triangle, by_force[k].triangle);
      EXPECT_NEAR(by_trees[k].lambda, by_force[k].lambda, 1e-9 * (1.0 + by_force[k].lambda));
    }
    found += by_trees.size();
  }
  EXPECT_GT(found, 200u);
}

TEST(ConeContacts, WithoutAnOpeningAreHits) {
  const Scene scene = crowd(93, 30);
  const World world = scene.world();
  Random random(94);
  int hits = 0;
  for (int i = 0; i < 500; ++i) {
    const Ray ray = random_ray(random, scene);
    const RayTruth hit = trace(world, ray);
    const auto found = contacts(world, cone_about(ray, 0.0));
    ASSERT_EQ(found.empty(), hit.status != HitStatus::hit);
    if (found.empty()) continue;
    ++hits;
    EXPECT_EQ(found[0].entity, hit.entity);
    EXPECT_EQ(found[0].lambda, hit.lambda);
  }
  EXPECT_GT(hits, 100);
}

TEST(BeamFractions, OfHalfAPlateAndWhatIsBehind) {
  Scene scene;
  Motion motion = at({10.0, 50.0, 0.0});
  motion.q_world = glm::angleAxis(0.5 * std::numbers::pi, glm::dvec3(0.0, 1.0, 0.0));
  const GeometryId plate = scene.add(make_rectangle(100.0, 100.0));
  scene.place(plate, motion);
  motion.p_world_m = {20.0, 0.0, 0.0};
  scene.place(plate, motion);
  motion.p_world_m = {30.0, 50.0, 0.0};
  scene.place(plate, motion);
  const auto fractions = beam_fractions(scene.world(), along_x(0.1), Faces::both, 4096);
  ASSERT_EQ(fractions.size(), 2u);
  EXPECT_NEAR(fractions[0].fraction, 0.5, 0.005);
  EXPECT_NEAR(fractions[1].fraction, 0.5, 0.005);
  EXPECT_EQ(fractions[1].entity.index, 1u);
}

/// The truth, rounded to single precision, is a right answer.
std::vector<ConeReturn> rounded(const World& world, const Cone& cone, const ConeQueryOptions& options) {
  std::vector<ConeReturn> returns(options.returns_per_cone);
  const auto truth = contacts(world, cone, options.faces);
  for (std::size_t i = 0; i < std::min<std::size_t>(truth.size(), returns.size()); ++i) {
    const EntityRow& row = world.find(truth[i].entity)->row;
    returns[i] = {.status = HitStatus::hit,
                  .lambda = static_cast<float>(truth[i].lambda),
                  .u = static_cast<float>(truth[i].u),
                  .v = static_cast<float>(truth[i].v),
                  .entity = truth[i].entity,
                  .mask = row.mask,
                  .material = row.material,
                  .triangle = truth[i].triangle,
                  .front_face = truth[i].front_face,
                  .n_world = glm::vec3(truth[i].n_world),
                  .v_relative_mps = glm::vec3(truth[i].v_relative_mps)};
  }
  return returns;
}

Verdict verdict_on(const World& world, const Cone& cone, const ConeQueryOptions& options,
                   std::span<const ConeReturn> returns) {
  const Judgement judgement = compare(world, cone, options, contacts(world, cone, options.faces), returns);
  EXPECT_EQ(judgement.reason.empty(), judgement.verdict == Verdict::agrees) << judgement.reason;
  return judgement.verdict;
}

ConeQueryOptions asking(std::uint32_t returns) {
  return {.name = "test", .capacity = 1, .returns_per_cone = returns};
}

TEST(CompareCone, AgreesWithTheRoundedTruth) {
  const Scene scene = crowd(95, 50);
  const World world = scene.world();
  Random random(96);
  for (int i = 0; i < 400; ++i) {
    const Cone cone = random_cone(random, scene);
    ConeQueryOptions options = asking(1u + static_cast<std::uint32_t>(i % 8));
    options.faces = static_cast<Faces>(i % 3);
    EXPECT_EQ(verdict_on(world, cone, options, rounded(world, cone, options)), Verdict::agrees) << i;
  }
}

struct Tampering {
  const char* name;
  std::function<void(ConeReturn&)> with;
};

class CompareTamperedCone : public testing::TestWithParam<Tampering> {};

TEST_P(CompareTamperedCone, IsCaught) {
  const Scene scene = crowd(97, 50);
  const World world = scene.world();
  Random random(98);
  int tried = 0;
  int caught = 0;
  for (int i = 0; i < 400; ++i) {
    const Cone cone = random_cone(random, scene);
    const ConeQueryOptions options = asking(3);
    auto returns = rounded(world, cone, options);
    if (returns[0].status != HitStatus::hit || glm::length(returns[0].v_relative_mps) < 0.1f) continue;
    GetParam().with(returns[0]);
    ++tried;
    caught += verdict_on(world, cone, options, returns) == Verdict::differs;
  }
  EXPECT_GT(tried, 100);
  // At the border of the cone both answers are accepted.
  EXPECT_GT(caught, tried * 95 / 100);
}

INSTANTIATE_TEST_SUITE_P(
    All, CompareTamperedCone,
    testing::Values(Tampering{"missing", [](ConeReturn& one) { one = {}; }},
                    Tampering{"nearer", [](ConeReturn& one) { one.lambda *= 0.99f; }},
                    Tampering{"farther", [](ConeReturn& one) { one.lambda *= 1.01f; }},
                    Tampering{"lambda_nan", [](ConeReturn& one) { one.lambda = std::nanf(""); }},
                    Tampering{"u", [](ConeReturn& one) { one.u += 2.0f; }},
                    Tampering{"v", [](ConeReturn& one) { one.v = std::nanf(""); }},
                    Tampering{"entity", [](ConeReturn& one) { one.entity.generation = 7; }},
                    Tampering{"no_such_triangle", [](ConeReturn& one) { one.triangle += 100'000; }},
                    Tampering{"face", [](ConeReturn& one) { one.front_face = !one.front_face; }},
                    Tampering{"normal", [](ConeReturn& one) { one.n_world *= -1.0f; }},
                    Tampering{"velocity", [](ConeReturn& one) { one.v_relative_mps *= 1.05f; }},
                    Tampering{"mask", [](ConeReturn& one) { one.mask ^= 64; }},
                    Tampering{"material", [](ConeReturn& one) { one.material.index += 1; }},
                    Tampering{"incomplete", [](ConeReturn& one) { one.status = HitStatus::incomplete; }}),
    [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace rtstdb::oracle
