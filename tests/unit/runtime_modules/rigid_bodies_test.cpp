// The parameters of the rigid_bodies module: what is refused, with place and numbers. And the law of one
// contact point.

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <hil/module.hpp>

#include "runtime/config/parse.hpp"
#include "runtime/modules/registry.hpp"
#include "runtime/modules/rigid_bodies/contact_law.hpp"

namespace hil::modules {
namespace {

const char* const box = "{body: box, mass: 8 kg, inertia: {box: [1 m, 1 m, 1 m]}}";

/// The mistakes of a scenario with these parameters in a task of 4 ms.
std::string mistakes_of(const std::string& bodies, const std::string& law) {
  config::Diagnostics diagnostics;
  const ModuleType& type = *find_module_type("rigid_bodies");
  const auto value =
      config::parse_text("test", "{bodies: [" + bodies + "], " + law + "}", type.parameters, diagnostics);
  if (value) type.create(*value, {.instance = "rigid", .period_ns = 4'000'000}, diagnostics);
  return diagnostics.to_text();
}

void expect_mistake(const std::string& bodies, const std::string& law, const std::string& text) {
  const std::string mistakes = mistakes_of(bodies, law);
  EXPECT_NE(mistakes.find(text), std::string::npos) << mistakes;
  EXPECT_EQ(mistakes.find("test:1:"), 0U) << mistakes;
}

// With four substeps of 1 ms: 0.1 m / h^2 is 800 kN/m, 0.2 m / h 1.6 kN s/m.
TEST(RigidBodiesParameters, LimitsOfStiffnessAndDamping) {
  EXPECT_EQ(mistakes_of(box, "stiffness: 800 kN/m, damping: 1.6 kN s/m"), "");
  expect_mistake(box, "stiffness: 801 kN/m, damping: 1 N s/m",
                 "'stiffness' is 801000 N/m, but with a substep of 1 ms and 'box' (8 kg) at most 800000 N/m "
                 "(0.1 m / h^2) is stable");
  expect_mistake(box, "stiffness: 1 kN/m, damping: 1.7 kN s/m",
                 "'damping' is 1700 N s/m, but with a substep of 1 ms and 'box' (8 kg) at most 1600 N s/m "
                 "(0.2 m / h) is stable");
  EXPECT_EQ(mistakes_of(box, "stiffness: 3200 kN/m, damping: 1 N s/m, substeps: 8"), "");
  // 8 kg and 2 kg have the reduced mass 1.6 kg; the pair of the lightest two decides.
  const std::string two = std::string(box) +
                          ", {body: heavy, mass: 90 kg, inertia: {sphere: {radius: 1 m}}}" +
                          ", {body: ball, mass: 2 kg, inertia: {sphere: {radius: 1 m}}}, {body: floor}";
  EXPECT_EQ(mistakes_of(two, "stiffness: 160 kN/m, damping: 320 N s/m"), "");
  expect_mistake(two, "stiffness: 161 kN/m, damping: 1 N s/m",
                 "'ball' and 'box' (reduced mass 1.6 kg) at most 160000 N/m");
}

TEST(RigidBodiesParameters, BodiesThatCanNotBe) {
  const char* const law = "stiffness: 1 N/m, damping: 0 N s/m";
  expect_mistake("{body: box, mass: 0 kg, inertia: {box: [1 m, 1 m, 1 m]}}", law, "'mass'");
  expect_mistake("{body: box, mass: 1 kg}", law, "'box' has a mass but no 'inertia'");
  expect_mistake("{body: box, inertia: {sphere: {radius: 1 m}}}", law, "'box' has an inertia but no 'mass'");
  expect_mistake("{body: floor}", law, "none of the bodies has a mass");
  expect_mistake(std::string(box) + ", " + box, law, "'box' is in the list of bodies already");
  expect_mistake("{body: box, mass: 1 kg, inertia: {moments: [1 kg m2, 1 kg m2, 5 kg m2]}}", law,
                 "one principal moment is larger than the sum of the other two");
  expect_mistake("{body: box, mass: 1 kg, inertia: {cone: 1 m}}", law, "cone");
}

/// A contact point of the first body, above the second.
FrozenContact contact(double depth_m, const glm::dvec3& velocity_mps = glm::dvec3(0.0)) {
  FrozenContact point;
  point.normal = {0.0, 0.0, 1.0};
  point.depth_m = depth_m;
  point.velocity_mps = velocity_mps;
  return point;
}
const ContactLaw law{.stiffness_npm = 1000.0, .damping_nspm = 10.0, .friction = 0.5};

/// The force of a pair of this one point, whose springs hold what the law has at its depth.
glm::dvec3 force_of(FrozenContact& point, const ContactLaw& contact_law) {
  const SpringEnergy energy = law_energy({&point, 1}, contact_law);
  StoredEnergy stored{.springs = energy};
  set_forces({&point, 1}, contact_law, energy, 0.0, 0.0, stored);
  return point.force_n();
}

TEST(ContactLaw, PushesAndNeverPulls) {
  FrozenContact point = contact(0.01, {0.0, 0.0, -0.5});
  EXPECT_DOUBLE_EQ(force_of(point, law).z, 15.0);
  point = contact(0.01, {0.0, 0.0, 0.5});
  EXPECT_DOUBLE_EQ(force_of(point, law).z, 5.0);
  point = contact(0.01, {0.0, 0.0, 5.0});
  EXPECT_EQ(force_of(point, law), glm::dvec3(0.0));
  point = contact(-0.01, {0.0, 0.0, -5.0});
  EXPECT_EQ(force_of(point, law), glm::dvec3(0.0));
}

TEST(ContactLaw, SticksUntilTheSpringIsStretchedToFriction) {
  FrozenContact point = contact(0.01, {1.0, 0.0, 0.0});  // N is 10 N, so the spring slips at 5 mm
  advance(point, 0.002);
  point.velocity_mps = glm::dvec3(0.0);
  EXPECT_DOUBLE_EQ(force_of(point, law).x, -2.0);
  point.velocity_mps.x = 1.0;
  for (int i = 0; i < 10; ++i)
    advance(point, 0.002);
  EXPECT_DOUBLE_EQ(force_of(point, law).x, -5.0);
  EXPECT_DOUBLE_EQ(point.stretch_m.x, 0.005);
  // Back by 5 mm, the spring is relaxed: its anchor has followed.
  point.velocity_mps.x = -1.0;
  advance(point, 0.005);
  point.velocity_mps.x = 0.0;
  EXPECT_NEAR(force_of(point, law).x, 0.0, 1e-12);
}

TEST(ContactLaw, DepthFollowsTheMotionAlongTheNormal) {
  FrozenContact point = contact(0.01, {3.0, 0.0, -0.5});
  advance(point, 0.002);
  EXPECT_DOUBLE_EQ(point.depth_m, 0.011);
}

/// Points of equal depth press as one; a point that only just touches presses with nothing.
TEST(ContactLaw, PointsShareTheStiffnessByTheirDepths) {
  FrozenContact points[] = {contact(0.01), contact(0.01), contact(0.01), contact(-0.001)};
  StoredEnergy stored{.springs = law_energy(points, law)};
  EXPECT_DOUBLE_EQ(stored.springs.normal_j, 0.5 * 1000.0 * 1e-4);
  set_forces(points, law, law_energy(points, law), 0.0, 0.0, stored);
  double sum_n = 0.0;
  for (const FrozenContact& point : points)
    sum_n += point.normal_force_n.z;
  EXPECT_DOUBLE_EQ(sum_n, 10.0);
  EXPECT_EQ(points[3].normal_force_n.z, 0.0);
  points[1].depth_m = points[2].depth_m = 1e-9;
  set_forces(points, law, law_energy(points, law), 0.0, 0.0, stored);
  EXPECT_NEAR(points[0].normal_force_n.z, 10.0, 1e-5);
}

/// While the bodies part, the springs give in proportion to what they hold; while they approach, they press
/// with the whole stiffness.
TEST(ContactLaw, SpringsGiveWhatTheyHold) {
  const ContactLaw undamped{.stiffness_npm = 1000.0};
  const auto force_n = [&](double speed_mps, double stored_share) {
    FrozenContact point = contact(0.01, {0.0, 0.0, speed_mps});
    const SpringEnergy by_law = law_energy({&point, 1}, undamped);
    StoredEnergy stored{.springs = {.normal_j = stored_share * by_law.normal_j}};
    set_forces({&point, 1}, undamped, by_law, 0.0, 0.0, stored);
    EXPECT_LE(stored.springs.normal_j, max_stiffening * by_law.normal_j);
    return point.normal_force_n.z;
  };
  EXPECT_DOUBLE_EQ(force_n(0.1, 0.3), 3.0);
  EXPECT_DOUBLE_EQ(force_n(-0.1, 0.3), 10.0);
  EXPECT_DOUBLE_EQ(force_n(0.1, -0.1), 0.0) << "they give nothing before they have taken what they gave";
  EXPECT_DOUBLE_EQ(force_n(0.1, 1.5), 15.0);
  EXPECT_DOUBLE_EQ(force_n(0.1, 5.0), 10.0 * max_stiffening);
}

/// A mass on a point whose depth, normal and number of neighbours jump at random: whatever they are, the
/// energy of motion never exceeds that at the start.
TEST(ContactLaw, JumpsOfDepthsAndNormalsAddNoEnergy) {
  const ContactLaw undamped{.stiffness_npm = 1000.0, .damping_nspm = 0.0, .friction = 0.4};
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    std::mt19937_64 random(seed);
    const auto uniform = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    glm::dvec3 v(uniform(-1.0, 1.0), uniform(-1.0, 1.0), -1.0);
    const double dt_s = 1e-3, initial_j = 0.5 * glm::dot(v, v);
    StoredEnergy stored;
    double highest_j = 0.0, largest_stored_j = 0.0;
    std::vector<FrozenContact> points;
    for (int i = 0; i < 2'000; ++i) {
      if (i % 10 == 0) {
        points.clear();
        const int count = std::uniform_int_distribution<int>(1, 4)(random);
        for (int k = 0; k < count; ++k) {
          points.push_back(contact(uniform(-0.01, 0.03)));
          points.back().normal =
              glm::normalize(glm::dvec3(uniform(-0.3, 0.3), uniform(-0.3, 0.3), uniform(-1.0, 1.0)));
          points.back().stretch_m = glm::cross(points.back().normal, glm::dvec3(uniform(-0.01, 0.01)));
        }
      }
      const SpringEnergy begin = law_energy(points, undamped);
      for (FrozenContact& point : points) {
        point.velocity_mps = v;
        advance(point, 0.5 * dt_s);
      }
      set_forces(points, undamped, begin, dt_s, 0.0, stored);
      for (const FrozenContact& point : points)
        v += dt_s * point.force_n();
      for (FrozenContact& point : points) {
        store_work(point, v, dt_s, stored);
        advance(point, 0.5 * dt_s);
      }
      const double stored_j =
          std::max(0.0, stored.springs.normal_j) + std::max(0.0, stored.springs.tangential_j);
      highest_j = std::max(highest_j, 0.5 * glm::dot(v, v) + stored_j);
      largest_stored_j = std::max(largest_stored_j, stored_j);
    }
    // More by what one substep gives: 1000 N/m and 1 kg have k h^2 / m of 1e-3.
    ASSERT_LE(highest_j, 1.01 * initial_j) << "seed " << seed;
    ASSERT_GT(largest_stored_j, 0.1 * initial_j) << "seed " << seed;
  }
}

}  // namespace
}  // namespace hil::modules
