// Contacts add no energy, give back what they store, and rest at the depth of the weight.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/gpu/runtime/rigid_bodies_fixture.hpp"
#include "tests/support/rounds.hpp"

namespace hil::modules {
namespace {

using namespace test;

constexpr double gravity_mps2 = 9.80665;
constexpr double mass_kg = 1.0;

enum class Shape { ball, box, hull };

struct EnergyCase {
  Shape shape;
  std::int64_t rate_hz;
  double margin_mm, damping_nspm, friction;

  std::string name() const {
    const char* const names[] = {"balls", "boxes", "hulls"};
    return std::string(names[static_cast<int>(shape)]) + ", " + std::to_string(rate_hz) + " Hz, margin " +
           std::to_string(margin_mm) + " mm, damping " + std::to_string(damping_nspm) + " N s/m, friction " +
           std::to_string(friction);
  }
};

/// Every combination; the short form tests a fraction of them, in which each two values of two properties
/// meet.
std::vector<EnergyCase> cases() {
  std::vector<EnergyCase> all;
  for (const Shape shape : {Shape::ball, Shape::box, Shape::hull}) {
    for (int bits = 0; bits < 16; ++bits) {
      const bool is_fast = bits % 2 == 1, is_wide = bits / 2 % 2 == 1, is_damped = bits / 4 % 2 == 1,
                 is_rough = bits / 8 == 1;
      const bool is_in_short_form = (bits % 2 + bits / 2 + bits / 4 + bits / 8) % 2 == 0;
      if (!tests::is_long() && !is_in_short_form) continue;
      all.push_back({.shape = shape,
                     .rate_hz = is_fast ? 1000 : 250,
                     .margin_mm = is_wide ? 40.0 : 10.0,
                     .damping_nspm = is_damped ? 10.0 : 0.0,
                     .friction = is_rough ? 0.5 : 0.0});
    }
  }
  return all;
}

class RigidBodiesEnergy : public RigidBodiesFixture {
 protected:
  struct Start {
    double energy_j = 0.0;  ///< above rest on the floor, at the lowest that the centre can be
    double lowest_m = 0.0;
  };

  double random(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  glm::dvec3 random_vector(double largest) {
    return {random(-largest, largest), random(-largest, largest), random(-largest, largest)};
  }
  glm::dquat random_turn() {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dquat(normal(random_), normal(random_), normal(random_), normal(random_)));
  }

  /// An irregular convex body of about 30 cm around its origin.
  rtstdb::TriangleMesh random_hull() {
    const auto kind = std::uniform_int_distribution<int>(0, 2)(random_);
    rtstdb::TriangleMesh mesh = kind == 0   ? rtstdb::make_cylinder(0.15, 0.2, 7)
                                : kind == 1 ? rtstdb::make_sphere(0.15, 1)
                                            : rtstdb::make_cylinder(0.15, 0.25, 3);
    const glm::vec3 scale(random(0.6, 1.2), random(0.6, 1.2), random(0.6, 1.2));
    for (glm::vec3& p_m : mesh.positions_m)
      p_m *= scale;
    return mesh;
  }

  void add_solid_ball(const std::string& name, const rtstdb::Motion& motion) {
    rtstdb::GeometryOptions options;
    options.solid = rtstdb::Solid{.kind = rtstdb::SolidKind::sphere, .radius_m = 0.1};
    rtstdb::EntityRow row;
    row.geometry = world_->add_geometry(rtstdb::make_sphere(0.1), name, options);
    row.mask = world_->mask_of({"body"}, "test");
    row.motion = motion;
    world_->create(name, row);
  }
  /// Adds a body at a random start and returns its entry in the list of bodies.
  std::string add_body(const std::string& name, Shape shape, const glm::dvec3& place_m) {
    rtstdb::Motion motion{.p_world_m = place_m,
                          .q_world = random_turn(),
                          .v_world_mps = random_vector(0.5),
                          .w_world_radps = random_vector(5.0)};
    double lowest_m = 0.1;
    std::string inertia = "{sphere: {radius: 10 cm}}";
    inertia_kgm2_ = glm::dvec3(0.4 * mass_kg * 0.01);
    if (shape == Shape::ball) {
      add_solid_ball(name, motion);
    } else {
      add(name, shape == Shape::box ? rtstdb::make_box({0.4, 0.3, 0.2}) : random_hull(), motion);
      inertia = "{box: [40 cm, 30 cm, 20 cm]}";
      inertia_kgm2_ = mass_kg / 12.0 * glm::dvec3(0.13, 0.2, 0.25);
      lowest_m = shape == Shape::box ? 0.1 : 0.05;
    }
    const glm::dvec3 w = glm::conjugate(motion.q_world) * motion.w_world_radps;
    starts_.push_back({.energy_j = 0.5 * mass_kg * glm::dot(motion.v_world_mps, motion.v_world_mps) +
                                   0.5 * glm::dot(w, inertia_kgm2_ * w) +
                                   mass_kg * gravity_mps2 * (place_m.z - lowest_m),
                       .lowest_m = lowest_m});
    return "{body: " + name + ", mass: 1 kg, inertia: " + inertia + "}";
  }

  /// Energy of the motion and the height, above rest on the floor.
  double energy_j(const std::vector<double>& outputs, std::size_t body) const {
    const auto vector = [&](BodyOutput first) {
      return glm::dvec3(of(outputs, body, first), of(outputs, body, static_cast<BodyOutput>(first + 1)),
                        of(outputs, body, static_cast<BodyOutput>(first + 2)));
    };
    const glm::dvec3 v = vector(vx), w = vector(wx);
    return 0.5 * mass_kg * glm::dot(v, v) + 0.5 * glm::dot(w, inertia_kgm2_ * w) +
           mass_kg * gravity_mps2 * (of(outputs, body, z) - starts_[body].lowest_m);
  }

  std::mt19937_64 random_;
  glm::dvec3 inertia_kgm2_{0.0};
  std::vector<Start> starts_;
};

class RigidBodiesEnergyOf : public RigidBodiesEnergy, public ::testing::WithParamInterface<EnergyCase> {};

/// A body's energy of motion and height stays below that at its start, and with the elastic energy of the
/// contacts all of it does. Most of the bodies touch the floor alone; the springs at the contacts give back
/// what they took.
TEST_P(RigidBodiesEnergyOf, NeverExceedsThatAtTheStart) {
  const EnergyCase& c = GetParam();
  SCOPED_TRACE(c.name());
  const auto count = static_cast<std::size_t>(tests::rounds(8, 20));
  // At least until the bodies have fallen.
  const double duration_s = std::max(0.6, 0.1 * static_cast<double>(tests::rounds(12, 600)));
  random_.seed(0xe4e6 + static_cast<std::uint64_t>(c.rate_hz * 8 + static_cast<int>(c.shape)));
  add_floor(100.0);
  std::string bodies = "bodies: [{body: floor}";
  for (std::size_t i = 0; i < count; ++i) {
    const double x_m = 8.0 * static_cast<double>(i % 5) - 16.0, y_m = 8.0 * std::floor(i / 5) - 12.0;
    bodies += ", " + add_body("body_" + std::to_string(i), c.shape, {x_m, y_m, random(0.4, 0.8)});
  }
  const auto module = rigid_bodies(
      "{" + bodies + "], stiffness: 10 kN/m, damping: " + std::to_string(c.damping_nspm) +
          " N s/m, friction: " + std::to_string(c.friction) + ", margin: " + std::to_string(c.margin_mm) +
          " mm, substeps: " + std::to_string(10'000 / c.rate_hz) + "}",
      1'000'000'000 / c.rate_hz);
  double highest_share = 0.0, lowest_dissipated_j = 0.0, first_energy_j = 0.0;
  for (const Start& start : starts_)
    first_energy_j += start.energy_j;
  std::size_t worst_body = 0;
  const std::vector<double> end = run_to(*module, duration_s, [&](const std::vector<double>& outputs) {
    lowest_dissipated_j = std::min(lowest_dissipated_j, outputs[dissipated]);
    if (outputs[touched] > static_cast<double>(count)) return;  // bodies have touched each other
    for (std::size_t i = 0; i < count; ++i) {
      const double share = energy_j(outputs, i) / starts_[i].energy_j;
      if (share <= highest_share) continue;
      highest_share = share;
      worst_body = i;
    }
  });
  EXPECT_LE(highest_share, 1.01) << "body " << worst_body;
  EXPECT_GE(lowest_dissipated_j, -1e-3 * first_energy_j);
  EXPECT_LE(lowest_dissipated_j, 0.0) << "the energy at the start is not the first";
  EXPECT_EQ(end[overflows], 0.0);
  EXPECT_GE(end[touched], static_cast<double>(count));
  RecordProperty("highest_share", std::to_string(highest_share));
  RecordProperty("end_share", std::to_string(end[energy] / first_energy_j));
}

INSTANTIATE_TEST_SUITE_P(Combinations, RigidBodiesEnergyOf, ::testing::ValuesIn(cases()));

struct Bounce {
  bool is_solid;  ///< else a mesh, whose facets also turn it
  const char* law;
  std::int64_t rate_hz;
};

class BouncingBall : public RigidBodiesEnergy, public ::testing::WithParamInterface<Bounce> {};

/// Without damping a ball comes back to 98 % of its height after ten bounces, whatever the stiffness, up to
/// the largest that is accepted, and also where a step moves it by more than the margin.
TEST_P(BouncingBall, ComesBackAfterTenBounces) {
  const Bounce& c = GetParam();
  add_floor(4.0);
  if (c.is_solid) {
    add_solid_ball("ball", {.p_world_m = {0.0, 0.0, 0.6}});
  } else {
    add("ball", rtstdb::make_sphere(0.1, 4), {.p_world_m = {0.0, 0.0, 0.6}});
  }
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 10 cm}}}], damping: 0 N "
      "s/m, friction: 0, " +
          std::string(c.law) + "}",
      1'000'000'000 / c.rate_hz);
  double peak_m = 0.0, first_energy_j = 0.0, highest_j = 0.0, last_j = 0.0;
  int bounces = 0;
  for (bool rises = false; bounces < 11;) {
    const std::vector<double> outputs = run_to(*module, 1e-9 * static_cast<double>(next_ns_));
    last_j = outputs[energy];
    if (first_energy_j == 0.0) first_energy_j = last_j;
    highest_j = std::max(highest_j, last_j);
    const double speed_mps = of(outputs, 0, vz);
    if (rises && speed_mps <= 0.0) ++bounces;
    if (!rises && speed_mps > 0.0) peak_m = 0.0;
    rises = speed_mps > 0.0;
    peak_m = std::max(peak_m, of(outputs, 0, z));
    ASSERT_LT(next_ns_, 20'000'000'000) << "it bounced " << bounces << " times";
  }
  EXPECT_LE(highest_j, first_energy_j * (1.0 + 1e-5));
  const double rest_j = mass_kg * gravity_mps2 * 0.1;
  EXPECT_GT((last_j - rest_j) / (first_energy_j - rest_j), 0.98);
  if (c.is_solid) {
    EXPECT_GT((peak_m - 0.1) / 0.5, 0.98);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Balls, BouncingBall,
    ::testing::Values(Bounce{true, "stiffness: 10 kN/m, margin: 40 mm, substeps: 40", 250},
                      Bounce{true, "stiffness: 10 kN/m, margin: 10 mm, substeps: 40", 250},
                      Bounce{true, "stiffness: 10 kN/m, margin: 10 mm, substeps: 10", 1000},
                      Bounce{true, "stiffness: 100 kN/m, margin: 40 mm, substeps: 4", 250},
                      Bounce{true, "stiffness: 1600 kN/m, margin: 40 mm, substeps: 4", 1000},
                      Bounce{false, "stiffness: 10 kN/m, margin: 40 mm, substeps: 40", 250},
                      Bounce{false, "stiffness: 1600 kN/m, margin: 10 mm, substeps: 4", 1000}));

/// With damping, bodies on one point and on several come to rest where a spring of the whole stiffness
/// carries them, also those that fell onto a corner.
TEST_F(RigidBodiesEnergy, BodiesRestAtTheDepthOfTheirWeight) {
  for (const std::int64_t rate_hz : {250, 1000}) {
    SCOPED_TRACE(rate_hz);
    const glm::dquat tilted = glm::angleAxis(0.3, glm::normalize(glm::dvec3(1.0, 0.4, 0.2)));
    add_floor(20.0);
    add_solid_ball("ball", {.p_world_m = {0.0, 0.0, 0.15}});
    add("box", rtstdb::make_box({0.4, 0.3, 0.2}), {.p_world_m = {2.0, 0.0, 0.35}, .q_world = tilted});
    add("prism", rtstdb::make_cylinder(0.15, 0.2, 7), {.p_world_m = {4.0, 0.0, 0.3}, .q_world = tilted});
    auto module = rigid_bodies(
        "{bodies: [{body: floor}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 10 cm}}}, {body: box, "
        "mass: 1 kg, inertia: {box: [40 cm, 30 cm, 20 cm]}}, {body: prism, mass: 1 kg, inertia: {cylinder: "
        "{radius: 15 cm, height: 20 cm}}}], stiffness: 10 kN/m, damping: 30 N s/m, substeps: " +
            std::to_string(10'000 / rate_hz) + "}",
        1'000'000'000 / rate_hz);
    const std::vector<double> end = run_to(*module, 6.0);
    const double depth_m = mass_kg * gravity_mps2 / 10e3;
    EXPECT_NEAR(0.1 - of(end, 0, z), depth_m, 0.002 * depth_m);
    EXPECT_NEAR(0.1 - of(end, 1, z), depth_m, 0.002 * depth_m);
    // An answer has four of its seven corners, and others in the next step: it trembles.
    EXPECT_NEAR(0.1 - of(end, 2, z), depth_m, 0.05 * depth_m);
    EXPECT_LT(end[kinetic_energy], 1e-3);
    EXPECT_NEAR(end[elastic_energy], 3.0 * 0.5 * mass_kg * gravity_mps2 * depth_m,
                0.05 * end[elastic_energy]);
    module.reset();
    world_.reset();
    database_.reset();
    SetUp();
    next_ns_ = 0;
  }
}

/// A force and a floor that rises do work: the energy grows by it, and nothing is dissipated.
TEST_F(RigidBodiesEnergy, GrowsByTheWorkOfInputsAndOfFixedBodies) {
  add("floor", rtstdb::make_box({4.0, 4.0, 1.0}),
      {.p_world_m = {0.0, 0.0, -0.5}, .v_world_mps = {0.0, 0.0, 0.5}}, "floor");
  add_solid_ball("ball", {.p_world_m = {0.0, 0.0, 0.3}});
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 10 cm}}}], stiffness: 10 "
      "kN/m, damping: 0 N s/m, friction: 0, margin: 40 mm, substeps: 10}",
      1'000'000);
  inputs_[0] = inputs_[5] = {.value = 0.01, .time_ns = 0, .fresh = true};
  const double first_j = run_to(*module, 0.0)[energy];
  const std::vector<double> end = run_to(*module, 3.0);
  EXPECT_GT(end[work], 5.0);
  EXPECT_NEAR(end[energy], first_j + end[work], 1e-4 * end[work]);
  EXPECT_NEAR(end[dissipated], 0.0, 1e-4 * end[work]);
}

/// A body that is held loses its energy of motion, which no contact has taken.
TEST_F(RigidBodiesEnergy, HoldingABodyIsWork) {
  add_floor();
  add_body("ball", Shape::ball, {0.0, 0.0, 3.0});
  const auto module = rigid_bodies(
      "{bodies: [{body: floor}, {body: ball, mass: 1 kg, inertia: {sphere: {radius: 10 cm}}}], stiffness: 10 "
      "kN/m, damping: 0 N s/m, substeps: 10}",
      1'000'000);
  const double moving_j = run_to(*module, 0.5)[kinetic_energy];
  inputs_[6] = {.value = 1.0, .time_ns = 0, .fresh = true};
  const std::vector<double> end = run_to(*module, 0.6);
  EXPECT_EQ(end[kinetic_energy], 0.0);
  EXPECT_NEAR(end[work], -moving_j, 0.1 * moving_j);
  EXPECT_NEAR(end[dissipated], 0.0, 1e-9);
}

}  // namespace
}  // namespace hil::modules
