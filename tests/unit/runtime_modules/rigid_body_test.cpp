// The motion of a free body against closed forms, and the order of its integration.

#include "runtime/modules/free_body/rigid_body.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hil::modules {
namespace {

using glm::dmat3;
using glm::dquat;
using glm::dvec3;

dmat3 diagonal(double xx, double yy, double zz) {
  return {dvec3(xx, 0.0, 0.0), dvec3(0.0, yy, 0.0), dvec3(0.0, 0.0, zz)};
}

RigidBodyState moved(const RigidBody& body, RigidBodyState state, const Wrench& wrench, double duration_s,
                     int steps) {
  for (int i = 0; i < steps; ++i)
    state = body.step(state, wrench, duration_s / steps);
  return state;
}

double angle_between(const dquat& a, const dquat& b) {
  const dquat turn = glm::conjugate(a) * b;
  return 2.0 * std::atan2(glm::length(dvec3(turn.x, turn.y, turn.z)), std::abs(turn.w));
}

/// A body with three different principal moments that turns about its middle axis, nearly: it tumbles.
const RigidBody tumbling({.mass_kg = 10.0, .inertia_kgm2 = diagonal(1.0, 2.0, 2.7)}, 0.0);

RigidBodyState tumble() {
  return tumbling.state({}, {}, dquat(1.0, 0.0, 0.0, 0.0), {0.02, 1.5, 0.01});
}

TEST(RigidBody, FreeRotationKeepsAngularMomentumAndEnergy) {
  const RigidBodyState start = tumble();
  const double energy_j = tumbling.rotational_energy_j(start);
  RigidBodyState state = start;
  double min_w_y = 1e9;
  for (int i = 0; i < 100'000; ++i) {  // 100 s at 1 kHz
    state = tumbling.step(state, {}, 1e-3);
    min_w_y = std::min(min_w_y, tumbling.w_body_radps(state).y);
    ASSERT_NEAR(tumbling.rotational_energy_j(state), energy_j, 1e-10 * energy_j) << "step " << i;
  }
  EXPECT_LT(min_w_y, -1.4) << "it did not tumble, so the test shows little";
  // From the attitude and the rates, not from the state alone.
  const dvec3 w = tumbling.w_body_radps(state);
  const dvec3 momentum = state.q_world * dvec3(1.0 * w.x, 2.0 * w.y, 2.7 * w.z);
  EXPECT_LT(glm::length(momentum - start.angular_momentum_world_nms), 1e-12);
  EXPECT_NEAR(glm::length(state.q_world), 1.0, 1e-15);
}

TEST(RigidBody, IntegrationHasOrderFour) {
  const Wrench wrench{.force_body_n = {3.0, -2.0, 1.0}, .torque_body_nm = {0.2, -0.1, 0.3}};
  const RigidBodyState exact = moved(tumbling, tumble(), wrench, 10.0, 80'000);
  double last_m = 0.0, last_rad = 0.0;
  for (const int steps : {250, 500, 1000}) {
    const RigidBodyState state = moved(tumbling, tumble(), wrench, 10.0, steps);
    const double error_m = glm::length(state.p_world_m - exact.p_world_m);
    const double error_rad = angle_between(state.q_world, exact.q_world);
    ASSERT_GT(error_m, 1e-13) << "rounding, not the method";
    if (last_m > 0.0) {
      EXPECT_NEAR(std::log2(last_m / error_m), 4.0, 0.3) << steps << " steps";
      EXPECT_NEAR(std::log2(last_rad / error_rad), 4.0, 0.3) << steps << " steps";
    }
    last_m = error_m;
    last_rad = error_rad;
  }
}

TEST(RigidBody, ConstantForceAlongAFixedDirection) {
  const RigidBody body({.mass_kg = 4.0, .inertia_kgm2 = diagonal(1.0, 1.0, 1.0)}, 0.0);
  const dquat quarter = glm::angleAxis(std::numbers::pi / 2.0, dvec3(0.0, 0.0, 1.0));
  const RigidBodyState start = body.state({1.0, 2.0, 3.0}, {0.5, 0.0, -1.0}, quarter, {});
  const RigidBodyState end = moved(body, start, {.force_body_n = {2.0, 0.0, 0.0}}, 6.0, 6);
  // 2 N along the body's x, which is the world's y: 0.5 m/s2.
  EXPECT_LT(glm::length(end.p_world_m - dvec3(4.0, 2.0 + 9.0, -3.0)), 1e-12);
  EXPECT_LT(glm::length(end.v_world_mps - dvec3(0.5, 3.0, -1.0)), 1e-12);
}

TEST(RigidBody, ConstantTorqueAboutAPrincipalAxis) {
  const RigidBody body({.mass_kg = 1.0, .inertia_kgm2 = diagonal(3.0, 2.0, 4.0)}, 0.0);
  const RigidBodyState start = body.state({}, {}, dquat(1.0, 0.0, 0.0, 0.0), {0.0, 0.0, 0.1});
  const RigidBodyState end = moved(body, start, {.torque_body_nm = {0.0, 0.0, 0.8}}, 5.0, 500);
  const double angle = 0.1 * 5.0 + 0.5 * 0.2 * 25.0;
  EXPECT_LT(angle_between(end.q_world, glm::angleAxis(angle, dvec3(0.0, 0.0, 1.0))), 1e-10);
  EXPECT_NEAR(body.w_world_radps(end).z, 1.1, 1e-12);
}

/// A symmetric top precesses about its angular momentum with L / I_transverse (Goldstein, "Classical
/// Mechanics").
TEST(RigidBody, SymmetricTopPrecesses) {
  const RigidBody body({.mass_kg = 1.0, .inertia_kgm2 = diagonal(2.0, 2.0, 1.0)}, 0.0);
  const RigidBodyState start = body.state({}, {}, dquat(1.0, 0.0, 0.0, 0.0), {0.3, 0.0, 2.0});
  const dvec3 momentum = start.angular_momentum_world_nms;
  const double t_s = 7.0;
  const RigidBodyState end = moved(body, start, {}, t_s, 7000);
  const dquat precession = glm::angleAxis(glm::length(momentum) / 2.0 * t_s, glm::normalize(momentum));
  const dquat spin = glm::angleAxis((1.0 / 1.0 - 1.0 / 2.0) * momentum.z * t_s, dvec3(0.0, 0.0, 1.0));
  EXPECT_LT(angle_between(end.q_world, precession * spin), 1e-9);
}

TEST(RigidBody, TensorNeedNotBeDiagonal) {
  const dquat tilt = glm::angleAxis(0.7, glm::normalize(dvec3(1.0, -2.0, 0.5)));
  const dmat3 rotation = glm::mat3_cast(tilt);
  const RigidBody tilted(
      {.mass_kg = 10.0, .inertia_kgm2 = rotation * diagonal(1.0, 2.0, 2.7) * glm::transpose(rotation)}, 0.0);
  // The body described in other axes.
  const RigidBodyState start = tilted.state({}, {}, glm::conjugate(tilt), tumbling.w_world_radps(tumble()));
  const RigidBodyState end = moved(tilted, start, {}, 20.0, 20'000);
  const RigidBodyState expected = moved(tumbling, tumble(), {}, 20.0, 20'000);
  EXPECT_LT(angle_between(end.q_world, expected.q_world * glm::conjugate(tilt)), 1e-8);
}

/// The closed solution of the Clohessy-Wiltshire equations without force (Vallado, "Fundamentals of
/// Astrodynamics and Applications"): x radial, y along the orbit, z across it.
TEST(RigidBody, ClohessyWiltshireAgainstItsClosedSolution) {
  const double n = 0.0011;
  const RigidBody body({.mass_kg = 12'000.0, .inertia_kgm2 = diagonal(5e4, 6e4, 7e4)}, n);
  const dvec3 p(30.0, -150.0, 12.0), v(0.02, -0.1, 0.05);
  const RigidBodyState start = body.state(p, v, dquat(1.0, 0.0, 0.0, 0.0), {});
  for (const double t : {60.0, 1500.0, 5712.0}) {  // the last is a whole orbit
    const RigidBodyState end = moved(body, start, {}, t, static_cast<int>(t));
    const double s = std::sin(n * t), c = std::cos(n * t);
    const dvec3 expected(
        (4.0 - 3.0 * c) * p.x + s / n * v.x + 2.0 / n * (1.0 - c) * v.y,
        6.0 * (s - n * t) * p.x + p.y - 2.0 / n * (1.0 - c) * v.x + (4.0 * s - 3.0 * n * t) / n * v.y,
        c * p.z + s / n * v.z);
    EXPECT_LT(glm::length(end.p_world_m - expected), 1e-7) << "after " << t << " s";
  }
}

TEST(RigidBody, BodyAtRestInAnInertialFrameTurnsInTheFrameOfTheOrbit) {
  const double n = 0.01;
  const RigidBody body({.mass_kg = 1.0, .inertia_kgm2 = diagonal(1.0, 2.0, 2.5)}, n);
  const RigidBodyState start = body.state({}, {}, dquat(1.0, 0.0, 0.0, 0.0), {0.0, 0.0, -n});
  EXPECT_LT(glm::length(body.w_body_radps(start)), 1e-15) << "a gyroscope measures nothing";
  const RigidBodyState end = moved(body, start, {}, 100.0, 1000);
  EXPECT_LT(angle_between(end.q_world, glm::angleAxis(-1.0, dvec3(0.0, 0.0, 1.0))), 1e-10);
}

/// A body that tumbles as seen from a turning frame is the same body as seen from an inertial one.
TEST(RigidBody, RotationDoesNotDependOnTheFrame) {
  const double n = 0.05;
  const RigidBody turning({.mass_kg = 10.0, .inertia_kgm2 = diagonal(1.0, 2.0, 2.7)}, n);
  const dvec3 w = tumbling.w_world_radps(tumble());
  const RigidBodyState start = turning.state({}, {}, dquat(1.0, 0.0, 0.0, 0.0), w - dvec3(0.0, 0.0, n));
  const double t_s = 15.0;
  const RigidBodyState seen = moved(turning, start, {}, t_s, 15'000);
  const RigidBodyState inertial = moved(tumbling, tumble(), {}, t_s, 15'000);
  const dquat frame = glm::angleAxis(n * t_s, dvec3(0.0, 0.0, 1.0));
  EXPECT_LT(angle_between(frame * seen.q_world, inertial.q_world), 1e-9);
}

/// A step of the leapfrog method under the force that `force_at` has at a position.
template <typename Force>
RigidBodyState leapfrog(const RigidBody& body, const RigidBodyState& state, Force force_at, double dt_s) {
  const RigidBodyState middle = body.drifted(state, 0.5 * dt_s);
  return body.drifted(body.kicked(middle, force_at(middle.p_world_m), {}, dt_s), 0.5 * dt_s);
}

RigidBodyState moved_by_leapfrog(const RigidBody& body, RigidBodyState state, double duration_s, int steps) {
  for (int i = 0; i < steps; ++i)
    state = leapfrog(
        body, state, [](const dvec3&) { return dvec3(0.0); }, duration_s / steps);
  return state;
}

/// Against the method of order 4: half the step, a quarter of the error. The angular momentum stays exactly.
TEST(RigidBody, LeapfrogRotationHasOrderTwo) {
  const double t_s = 4.0;
  const RigidBodyState exact = moved(tumbling, tumble(), {}, t_s, 40'000);
  const auto error = [&](int steps) {
    const RigidBodyState state = moved_by_leapfrog(tumbling, tumble(), t_s, steps);
    EXPECT_EQ(state.angular_momentum_world_nms, tumble().angular_momentum_world_nms);
    return angle_between(state.q_world, exact.q_world);
  };
  const double coarse = error(1'000), fine = error(2'000);
  EXPECT_GT(fine, 1e-9) << "so small that rounding decides";
  EXPECT_NEAR(coarse / fine, 4.0, 0.2);
}

/// A mass on a spring, near the largest stiffness of a contact: the energy oscillates but does not grow.
TEST(RigidBody, LeapfrogSpringKeepsItsEnergy) {
  const RigidBody body({.mass_kg = 2.0, .inertia_kgm2 = diagonal(1.0, 1.0, 1.0)}, 0.0);
  const double dt_s = 1e-3, stiffness_npm = 0.1 * 2.0 / (dt_s * dt_s);
  RigidBodyState state = body.state({0.01, 0.0, 0.0}, {}, dquat(1.0, 0.0, 0.0, 0.0), {});
  const auto energy = [&] {
    return 0.5 * stiffness_npm * glm::dot(state.p_world_m, state.p_world_m) +
           0.5 * 2.0 * glm::dot(state.v_world_mps, state.v_world_mps);
  };
  const double begin_j = energy();
  for (int i = 0; i < 100'000; ++i) {
    state = leapfrog(
        body, state, [&](const dvec3& p_m) { return -stiffness_npm * p_m; }, dt_s);
    ASSERT_NEAR(energy(), begin_j, 0.05 * begin_j) << "step " << i;
  }
}

TEST(RigidBody, LeapfrogOrbitFollowsTheOtherMethod) {
  const RigidBody body({.mass_kg = 1.0, .inertia_kgm2 = diagonal(1.0, 2.0, 2.5)}, 0.01);
  const RigidBodyState start =
      body.state({10.0, -20.0, 5.0}, {0.1, 0.2, -0.1}, dquat(1.0, 0.0, 0.0, 0.0), {0.02, 0.0, -0.01});
  const RigidBodyState exact = moved(body, start, {}, 50.0, 5'000);
  const RigidBodyState state = moved_by_leapfrog(body, start, 50.0, 50'000);
  EXPECT_LT(glm::distance(state.p_world_m, exact.p_world_m), 1e-3);
  EXPECT_GT(glm::distance(state.p_world_m, start.p_world_m), 5.0);
  EXPECT_LT(angle_between(state.q_world, exact.q_world), 1e-3);
}

TEST(RigidBody, RotationVectorsAndRotations) {
  const dquat q = glm::angleAxis(0.7, glm::normalize(dvec3(1.0, 2.0, -1.0)));
  for (const dvec3& turn :
       {dvec3(0.0), dvec3(1e-12, 0.0, 0.0), dvec3(0.3, -0.2, 1.0), dvec3(0.0, 3.0, 0.0)}) {
    const dquat after = turned(q, turn);
    EXPECT_NEAR(glm::length(after), 1.0, 1e-15);
    EXPECT_LT(glm::distance(rotation_vector_rad(after * glm::conjugate(q)), turn), 1e-14);
    EXPECT_LT(glm::distance(rotation_vector_rad(-(after * glm::conjugate(q))), turn), 1e-14);
  }
  EXPECT_LT(angle_between(turned(q, {0.0, 0.0, 0.5}), glm::angleAxis(0.5, dvec3(0.0, 0.0, 1.0)) * q), 1e-15);
}

TEST(RigidBody, TensorsThatNoBodyHas) {
  EXPECT_EQ(fault_of_inertia(diagonal(1.0, 2.0, 3.0)), "") << "a plate";
  EXPECT_EQ(fault_of_inertia(diagonal(0.333333, 0.333333, 0.666667)), "") << "a plate, rounded";
  EXPECT_EQ(fault_of_inertia(diagonal(1e-6, 1.0, 1.0)), "") << "a thin rod";
  EXPECT_NE(fault_of_inertia(diagonal(1.0, 2.0, 3.1)), "");
  EXPECT_NE(fault_of_inertia(diagonal(0.0, 1.0, 1.0)), "");
  EXPECT_NE(fault_of_inertia(diagonal(-1.0, 1.0, 1.0)), "");
  dmat3 coupled = diagonal(1.0, 1.0, 1.0);
  coupled[0][1] = coupled[1][0] = 0.4;
  EXPECT_EQ(fault_of_inertia(coupled), "");
  coupled[0][1] = coupled[1][0] = 0.6;  // moments 0.4, 1, 1.6
  EXPECT_NE(fault_of_inertia(coupled), "");
  coupled[0][1] = coupled[1][0] = 1.2;
  EXPECT_NE(fault_of_inertia(coupled), "");
}

}  // namespace
}  // namespace hil::modules
