// Bodies that touch, in a world: closed forms of what rests, slides, rolls and collides.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "tests/gpu/runtime/rigid_bodies_fixture.hpp"
#include "tests/support/concave_meshes.hpp"
#include "tests/support/rounds.hpp"

namespace hil::modules {
namespace {

using namespace test;

constexpr std::int64_t ms = 1'000'000;
constexpr double gravity_mps2 = 9.80665;

class RigidBodiesModule : public RigidBodiesFixture {};
class RollingBody : public RigidBodiesFixture {};

/// Ten boxes of 1 m and 10 kg, laid on one another without gaps. At 3 s they have settled; until 5 s each
/// moves by less than 1 mm from where it was then, and its kinetic energy is below 1e-4 of m g a.
TEST_F(RigidBodiesModule, AStackOfTenBoxesRests) {
  constexpr int count = 10;
  constexpr double mass_kg = 10.0, edge_m = 1.0;
  add_floor();
  std::string bodies = "bodies: [{body: floor}";
  for (int i = 0; i < count; ++i) {
    const std::string name = "box_" + std::to_string(i);
    add(name, rtstdb::make_box({edge_m, edge_m, edge_m}), {.p_world_m = {0.0, 0.0, 0.5 + i}});
    bodies += ", {body: " + name + ", mass: 10 kg, inertia: {box: [1 m, 1 m, 1 m]}}";
  }
  const auto module = rigid_bodies(
      "{" + bodies + "], stiffness: 2 MN/m, damping: 2 kN s/m, substeps: 10, margin: 5 mm}", 5 * ms);
  const std::vector<double> settled = run_to(*module, 3.0);
  double largest_energy_j = 0.0, largest_drift_m = 0.0;
  const std::vector<double> end = run_to(*module, 5.0, [&](const std::vector<double>& outputs) {
    largest_energy_j = std::max(largest_energy_j, outputs[kinetic_energy]);
    for (std::size_t i = 0; i < count; ++i) {
      for (const BodyOutput axis : {x, y, z})
        largest_drift_m = std::max(largest_drift_m, std::abs(of(outputs, i, axis) - of(settled, i, axis)));
    }
  });
  // The energy of all boxes together is below the limit of one.
  EXPECT_LT(largest_energy_j, 1e-4 * mass_kg * gravity_mps2 * edge_m);
  EXPECT_LT(largest_drift_m, 1e-3);
  RecordProperty("energy_j", std::to_string(largest_energy_j));
  RecordProperty("drift_m", std::to_string(largest_drift_m));
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_NEAR(of(end, i, x), 0.0, 1e-3) << "box " << i;
    EXPECT_NEAR(of(end, i, y), 0.0, 1e-3) << "box " << i;
    // Each contact below carries the boxes from there on.
    double sunk_m = 0.0;
    for (std::size_t below = 0; below <= i; ++below)
      sunk_m += (count - static_cast<double>(below)) * mass_kg * gravity_mps2 / 2e6;
    EXPECT_NEAR(of(end, i, z), 0.5 + static_cast<double>(i) - sunk_m, 2e-4) << "box " << i;
  }
  EXPECT_GE(end[contacts], 10.0);
  EXPECT_EQ(end[touched], 10.0);
  EXPECT_EQ(end[undecided], 0.0);
  EXPECT_EQ(end[overflows], 0.0);
  EXPECT_EQ(end[late], 0.0);
}

/// A box that falls by 5 cm comes to rest where the springs carry it.
TEST_F(RigidBodiesModule, ADroppedBoxRestsAtTheDepthOfItsWeight) {
  add_floor();
  add("box", rtstdb::make_box({0.4, 0.6, 0.2}), {.p_world_m = {0.3, -0.2, 0.15}});
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: box, mass: 8 kg, inertia: {box: [40 cm, 60 cm, 20 cm]}}], "
      "stiffness: 80 kN/m, damping: 400 N s/m, substeps: 4}",
      4 * ms);
  double deepest_m = 0.0;
  const std::vector<double> end = run_to(*module, 3.0, [&](const std::vector<double>& outputs) {
    deepest_m = std::max(deepest_m, outputs[depth]);
  });
  const double expected_m = 8.0 * gravity_mps2 / 80e3;
  EXPECT_GT(deepest_m, 3.0 * expected_m) << "it did not fall";
  EXPECT_NEAR(0.1 - of(end, 0, z), expected_m, 0.01 * expected_m);
  EXPECT_NEAR(end[depth], expected_m, 0.01 * expected_m);
  EXPECT_EQ(end[contacts], 4.0);
  EXPECT_LT(end[kinetic_energy], 1e-9);
  // It fell for 0.101 s: the speed is that at the begin of the substep of 1 ms in which it touches.
  ASSERT_TRUE(has_event("floor touches box at 0.98")) << events_.events().size();
}

/// A box of 1 m on a plate that is inclined by an angle: how far it slides in 2 s, and its speed then.
struct Slide {
  double displacement_m = 0.0, speed_mps = 0.0;
};

class Slope : public RigidBodiesFixture {
 protected:
  Slide slide(double angle_rad, const std::string& friction) {
    const glm::dquat turn = glm::angleAxis(angle_rad, glm::dvec3(0.0, 1.0, 0.0));  // down toward +x
    add("floor", rtstdb::make_box({40.0, 4.0, 1.0}),
        {.p_world_m = turn * glm::dvec3(0.0, 0.0, -0.5), .q_world = turn}, "floor");
    add("box", rtstdb::make_box({1.0, 1.0, 0.5}),
        {.p_world_m = turn * glm::dvec3(-5.0, 0.0, 0.25), .q_world = turn});
    const auto module = rigid_bodies(
        "{bodies: [{body: floor}, {body: box, mass: 100 kg, inertia: {box: [1 m, 1 m, 0.5 m]}}], "
        "stiffness: 10 MN/m, damping: 20 kN s/m, substeps: 4, friction: " +
            friction + "}",
        4 * ms);
    const std::vector<double> begin = run_to(*module, 0.5), end = run_to(*module, 2.5);
    const auto along = [&](const std::vector<double>& outputs, BodyOutput first) {
      const glm::dvec3 v(of(outputs, 0, first), of(outputs, 0, static_cast<BodyOutput>(first + 1)),
                         of(outputs, 0, static_cast<BodyOutput>(first + 2)));
      return glm::dot(v, turn * glm::dvec3(1.0, 0.0, 0.0));
    };
    EXPECT_NEAR(of(end, 0, y), 0.0, 1e-3);
    speed_at_begin_mps_ = along(begin, vx);
    return {.displacement_m = along(end, x) - along(begin, x), .speed_mps = along(end, vx)};
  }
  double speed_at_begin_mps_ = 0.0;
};

// tan(25 deg) is 0.466, tan(28 deg) 0.532.
TEST_F(Slope, ABoxSticksBelowTheFrictionAngle) {
  const Slide result = slide(25.0 * std::numbers::pi / 180.0, "0.5");
  EXPECT_NEAR(result.displacement_m, 0.0, 1e-5);
  EXPECT_NEAR(result.speed_mps, 0.0, 1e-6);
}

TEST_F(Slope, ABoxSlidesJustAboveTheFrictionAngle) {
  const double angle_rad = 28.0 * std::numbers::pi / 180.0;
  const Slide result = slide(angle_rad, "0.5");
  const double expected_mps2 = gravity_mps2 * (std::sin(angle_rad) - 0.5 * std::cos(angle_rad));
  EXPECT_NEAR((result.speed_mps - speed_at_begin_mps_) / 2.0, expected_mps2, 0.01 * expected_mps2);
}

TEST_F(Slope, ABoxSlidesWithTheAccelerationThatFrictionLeaves) {
  const double angle_rad = 40.0 * std::numbers::pi / 180.0;
  const Slide result = slide(angle_rad, "0.3");
  const double expected_mps2 = gravity_mps2 * (std::sin(angle_rad) - 0.3 * std::cos(angle_rad));
  EXPECT_NEAR((result.speed_mps - speed_at_begin_mps_) / 2.0, expected_mps2, 0.002 * expected_mps2);
  EXPECT_GT(result.displacement_m, 5.0);
}

/// A polygon of 1024 corners in place of a circle. The load is carried by the corners of one of its faces,
/// which sink and rise as it rolls, so its width, the stiffness and the damping determine the loss.
TEST_F(RollingBody, ACylinderKeepsItsSpeed) {
  const bool is_long = tests::is_long();
  const double duration_s = is_long ? 60.0 : 5.0;
  constexpr double radius_m = 0.5;
  const double speed_mps = is_long ? 0.25 : 1.0;
  add_floor();
  // The axis of the cylinder is its z axis; it lies along the world's y axis.
  add("cylinder", rtstdb::make_cylinder(radius_m, 1.0, 1024),
      {.p_world_m = {-7.5, 0.0, radius_m},
       .q_world = glm::angleAxis(-std::numbers::pi / 2.0, glm::dvec3(1.0, 0.0, 0.0)),
       .v_world_mps = {speed_mps, 0.0, 0.0},
       .w_world_radps = {0.0, speed_mps / radius_m, 0.0}});
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: cylinder, mass: 10 kg, inertia: {cylinder: {radius: 0.5 m, height: 1 "
      "m}}}], stiffness: 50 kN/m, damping: 50 N s/m, substeps: 2}",
      2 * ms);
  const std::vector<double> end = run_to(*module, duration_s);
  EXPECT_NEAR(of(end, 0, vx), speed_mps, 0.01 * speed_mps);
  EXPECT_NEAR(of(end, 0, wz), speed_mps / radius_m, 0.01 * speed_mps / radius_m) << "it rolls";
  EXPECT_NEAR(of(end, 0, x), -7.5 + speed_mps * duration_s, 0.01 * duration_s);
  EXPECT_NEAR(of(end, 0, y), 0.0, 1e-3);
  // Where single answers do not decide where they touch, the points before them carry the cylinder.
  EXPECT_LT(end[undecided], 1e-3 * duration_s / 2e-3);
}

/// Two boxes meet off their centres, without gravity: linear and angular momentum stay, and some energy is
/// lost.
TEST_F(RigidBodiesModule, ACollisionConservesMomentum) {
  const glm::dvec3 v_left(2.0, 0.0, 0.1), v_right(-1.0, 0.3, 0.0);
  add("left", rtstdb::make_box({1.0, 1.0, 1.0}), {.p_world_m = {-1.0, 0.0, 0.0}, .v_world_mps = v_left});
  add("right", rtstdb::make_box({0.8, 0.6, 0.4}),
      {.p_world_m = {1.0, 0.35, 0.2}, .v_world_mps = v_right, .w_world_radps = {0.5, 1.0, -0.7}});
  const auto module = rigid_bodies(
      "{bodies: [{body: left, mass: 3 kg, inertia: {box: [1 m, 1 m, 1 m]}}, {body: right, mass: 2 kg, "
      "inertia: {moments: [0.2 kg m2, 0.25 kg m2, 0.3 kg m2]}}], gravity: [0 m/s2, 0 m/s2, 0 m/s2], "
      "stiffness: 50 kN/m, damping: 80 N s/m, margin: 20 mm}",
      2 * ms);
  struct Sums {
    glm::dvec3 linear{0.0}, angular{0.0};
  };
  const auto sums = [&](const std::vector<double>& outputs) {
    const auto vector = [&](std::size_t body, BodyOutput first) {
      return glm::dvec3(of(outputs, body, first), of(outputs, body, static_cast<BodyOutput>(first + 1)),
                        of(outputs, body, static_cast<BodyOutput>(first + 2)));
    };
    Sums total;
    const double masses[] = {3.0, 2.0};
    const glm::dvec3 moments[] = {glm::dvec3(0.5), {0.2, 0.25, 0.3}};
    for (std::size_t i = 0; i < 2; ++i) {
      const glm::dquat q(of(outputs, i, qw), of(outputs, i, qx), of(outputs, i, qy), of(outputs, i, qz));
      total.linear += masses[i] * vector(i, vx);
      total.angular += masses[i] * glm::cross(vector(i, x), vector(i, vx)) + q * (moments[i] * vector(i, wx));
    }
    return total;
  };
  const std::vector<double> begin = run_to(*module, 0.0), end = run_to(*module, 1.5);
  ASSERT_EQ(end[touched], 1.0);
  EXPECT_GT(std::abs(of(end, 0, vx) - 2.0), 0.5) << "no momentum was exchanged";
  EXPECT_LT(glm::distance(sums(begin).linear, sums(end).linear), 1e-12);
  EXPECT_LT(glm::distance(sums(begin).angular, sums(end).angular), 1e-12);
  EXPECT_LT(end[kinetic_energy], begin[kinetic_energy]);
  EXPECT_GT(end[kinetic_energy], 0.1 * begin[kinetic_energy]);
}

/// Without damping and friction a ball that falls on a plate comes back to its height.
TEST_F(RigidBodiesModule, ABallBouncesWithoutLoss) {
  add_floor();
  add("ball", rtstdb::make_sphere(0.2, 4), {.p_world_m = {0.0, 0.0, 0.45}});
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 20 cm}}}], stiffness: 20 "
      "kN/m, damping: 0 N s/m, friction: 0, substeps: 20, margin: 20 mm}",
      5 * ms);
  double lowest_peak_m = 1.0, peak_m = 0.0;
  bool rises = false;
  int bounces = 0;
  run_to(*module, 3.0, [&](const std::vector<double>& outputs) {
    const double speed_mps = of(outputs, 0, vz);
    if (speed_mps > 0.0) peak_m = std::max(peak_m, of(outputs, 0, z));
    if (rises && speed_mps <= 0.0) {
      lowest_peak_m = std::min(lowest_peak_m, peak_m);
      peak_m = 0.0;
      ++bounces;
    }
    rises = speed_mps > 0.0;
  });
  EXPECT_GE(bounces, 5);
  EXPECT_NEAR(lowest_peak_m, 0.45, 0.01);
}

/// A body without contacts and torques keeps its angular momentum and its energy, also about the axis about
/// which rotation is unstable.
TEST_F(RigidBodiesModule, ATumblingBodyKeepsItsEnergy) {
  add("box", rtstdb::make_box({0.1, 0.2, 0.3}), {.w_world_radps = {0.01, 10.0, 0.01}});
  const auto module = rigid_bodies(
      "{bodies: [{body: box, mass: 1 kg, inertia: {moments: [1 kg m2, 2 kg m2, 2.7 kg m2]}}], gravity: [0 "
      "m/s2, 0 m/s2, 0 m/s2], stiffness: 1 kN/m, damping: 1 N s/m, substeps: 1}",
      1 * ms);
  bool turned_over = false;
  const std::vector<double> end = run_to(*module, 5.0, [&](const std::vector<double>& outputs) {
    EXPECT_NEAR(outputs[kinetic_energy], 100.0, 0.01);
    turned_over = turned_over || of(outputs, 0, wy) < -9.0;
  });
  EXPECT_TRUE(turned_over);
}

/// A ball that falls into a bowl, which is not convex, rests on its bottom.
TEST_F(RigidBodiesModule, ABallRestsInABowl) {
  add("bowl", rtstdb::test::make_bowl(1.0, 0.8, 32), {}, "floor");
  add("ball", rtstdb::make_sphere(0.2), {.p_world_m = {0.05, 0.0, -0.4}});
  const auto module = rigid_bodies(
      "{bodies: [{body: bowl}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 20 cm}}}], stiffness: 20 "
      "kN/m, damping: 100 N s/m, substeps: 4}",
      2 * ms);
  const std::vector<double> end = run_to(*module, 3.0);
  EXPECT_EQ(end[undecided], 0.0);
  EXPECT_EQ(end[overflows], 0.0);
  // The facets of both meshes lie up to 4 mm within the round surfaces.
  EXPECT_NEAR(std::hypot(of(end, 0, x), of(end, 0, y), of(end, 0, z)), 0.6, 0.01);
  EXPECT_LT(of(end, 0, z), -0.55);
}

/// An L, which is not convex, falls on the floor and rests on its side.
TEST_F(RigidBodiesModule, ABodyThatIsNotConvexRestsOnTheFloor) {
  add_floor();
  rtstdb::TriangleMesh angle = rtstdb::test::make_l_shape(1.0, 0.3, 0.4);
  for (glm::vec3& p_m : angle.positions_m)
    p_m -= glm::vec3(0.36f, 0.36f, 0.2f);  // its centre of mass, which is beside its arms
  add("angle", angle, {.p_world_m = {0.0, 0.0, 0.205}});
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: angle, mass: 10 kg, inertia: {box: [1 m, 1 m, 40 cm]}}], stiffness: "
      "100 kN/m, damping: 2 kN s/m, substeps: 4}",
      2 * ms);
  const std::vector<double> end = run_to(*module, 2.0);
  EXPECT_EQ(end[undecided], 0.0);
  // Four of its six lower corners press, and others in the next step: about 1e-6 m g a remain.
  EXPECT_LT(end[kinetic_energy], 1e-5 * 10.0 * gravity_mps2 * 1.0);
  EXPECT_NEAR(of(end, 0, z), 0.2, 2e-3);
}

/// Values that are impossible for the shapes and places of the bodies are refused before the first step.
class RefusedBodies : public RigidBodiesFixture {
 protected:
  /// The fault of a crate of 1 m and 10 kg on the floor.
  std::string fault_of(const std::string& inertia, const std::string& stiffness, double height_m) {
    add("crate", rtstdb::make_box({1.0, 1.0, 1.0}), {.p_world_m = {0.0, 0.0, height_m}});
    add_floor();
    try {
      rigid_bodies("{bodies: [{body: floor}, {body: crate, mass: 10 kg, inertia: {" + inertia +
                       "}}], stiffness: " + stiffness + ", damping: 100 N s/m}",
                   2 * ms);
    } catch (const SetupError& error) {
      return error.what();
    }
    return {};
  }
  static void expect_contains(const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << '"' << text << '"';
  }
};

TEST_F(RefusedBodies, ACrateThatTouchesTheFloorIsAccepted) {
  EXPECT_EQ(fault_of("box: [1 m, 1 m, 1 m]", "100 kN/m", 0.5), "");
}

TEST_F(RefusedBodies, AnInertiaTooSmallForTheShape) {
  const std::string fault = fault_of("moments: [1e-6 kg m2, 1e-6 kg m2, 1e-6 kg m2]", "100 kN/m", 0.5);
  expect_contains(fault, "'crate' has so small an inertia for the size of its shape");
  // The mass at a corner is 1e-6 / 0.75 kg, the substep 0.5 ms: 2 m / h^2 and 2 m / h.
  expect_contains(fault, "a stiffness of at most 10.6667 N/m and a damping of at most 0.00533333 N s/m");
}

TEST_F(RefusedBodies, AWeightThatSinksTheBody) {
  expect_contains(
      fault_of("box: [1 m, 1 m, 1 m]", "100 N/m", 0.5),
      "'crate' rests 0.980665 m deep under its weight (mass 10 kg, gravity 9.80665 m/s2, stiffness "
      "100 N/m), more than half of the smallest edge of its box, 1 m");
}

TEST_F(RefusedBodies, BodiesThatOverlapAtTheStart) {
  const std::string fault = fault_of("box: [1 m, 1 m, 1 m]", "100 kN/m", 0.4);
  expect_contains(fault, "'crate'");
  expect_contains(fault, "'floor'");
  expect_contains(fault, "overlap by 0.1 m at the start");
  expect_contains(fault, "at most 0.03464 m are allowed");
}

/// Without damping a ball that falls on a large plate neither gains energy nor loses any in 2.5 s and three
/// bounces, in which steps of 2 ms move it by 9 mm.
TEST_F(RigidBodiesModule, ABallThatBouncesOnALargePlateKeepsItsEnergy) {
  add("floor", rtstdb::make_box({100.0, 10.0, 1.0}), {.p_world_m = {0.0, 0.0, -0.5}}, "floor");
  rtstdb::GeometryOptions options;
  options.solid = rtstdb::Solid{.kind = rtstdb::SolidKind::sphere, .radius_m = 0.1};
  rtstdb::EntityRow ball;
  ball.geometry = world_->add_geometry(rtstdb::make_sphere(0.1), "ball", options);
  ball.mask = world_->mask_of({"body"}, "test");
  ball.motion.p_world_m = {0.0, 0.0, 1.1};
  world_->create("ball", ball);
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 10 cm}}}], stiffness: 50 "
      "kN/m, damping: 0 N s/m, friction: 0, margin: 20 mm}",
      2 * ms);
  double min_j = 1e9, max_j = 0.0;
  run_to(*module, 2.5, [&](const std::vector<double>& outputs) {
    if (of(outputs, 0, z) < 0.13) return;  // a spring holds some of it
    const double energy_j = outputs[kinetic_energy] + gravity_mps2 * of(outputs, 0, z);
    min_j = std::min(min_j, energy_j);
    max_j = std::max(max_j, energy_j);
  });
  EXPECT_GT(min_j, 0.98 * 1.1 * gravity_mps2);
  EXPECT_LT(max_j, 1.02 * 1.1 * gravity_mps2);
}

}  // namespace
}  // namespace hil::modules
