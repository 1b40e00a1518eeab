// The parameters of the rigid_bodies module: what is refused, with place and numbers. And the law of one
// contact point.

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "runtime/config/parse.hpp"
#include "runtime/modules/module.hpp"
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
FrozenContact contact(double depth_m) {
  FrozenContact point;
  point.normal = {0.0, 0.0, 1.0};
  point.depth_m = depth_m;
  return point;
}
const ContactLaw law{.stiffness_npm = 1000.0, .damping_nspm = 10.0, .friction = 0.5};

TEST(ContactLaw, PushesAndNeverPulls) {
  FrozenContact point = contact(0.01);
  EXPECT_DOUBLE_EQ(contact_force(point, law, {0.0, 0.0, -0.5}).z, 15.0);
  EXPECT_DOUBLE_EQ(contact_force(point, law, {0.0, 0.0, 0.5}).z, 5.0);
  EXPECT_EQ(contact_force(point, law, {0.0, 0.0, 5.0}), glm::dvec3(0.0));
  point = contact(-0.01);
  EXPECT_EQ(contact_force(point, law, {0.0, 0.0, -5.0}), glm::dvec3(0.0));
}

TEST(ContactLaw, SticksUntilTheSpringIsStretchedToFriction) {
  FrozenContact point = contact(0.01);  // N is 10 N, so the spring slips at 5 mm
  const glm::dvec3 v(1.0, 0.0, 0.0);
  follow(point, v, 0.002, true);
  EXPECT_DOUBLE_EQ(contact_force(point, law, glm::dvec3(0.0)).x, -2.0);
  for (int i = 0; i < 10; ++i)
    follow(point, v, 0.002, true);
  EXPECT_DOUBLE_EQ(contact_force(point, law, v).x, -5.0);
  EXPECT_DOUBLE_EQ(point.stretch_m.x, 0.005);
  // Back by 5 mm, the spring is relaxed: its anchor has followed.
  follow(point, -v, 0.005, true);
  EXPECT_NEAR(contact_force(point, law, glm::dvec3(0.0)).x, 0.0, 1e-12);
}

TEST(ContactLaw, DepthFollowsTheMotionAlongTheNormal) {
  FrozenContact point = contact(0.01);
  follow(point, {3.0, 0.0, -0.5}, 0.002, false);
  EXPECT_DOUBLE_EQ(point.depth_m, 0.011);
}

}  // namespace
}  // namespace hil::modules
