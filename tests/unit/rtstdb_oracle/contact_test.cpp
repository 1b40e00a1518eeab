// Distances, depths and normals of two bodies against closed forms.

#include <gtest/gtest.h>

#include <cmath>

#include <rtstdb/limits.hpp>

#include "contact_scene.hpp"

namespace rtstdb::oracle {
namespace {

const glm::dvec3 cube_m{2.0, 2.0, 2.0};

void expect_pair(const PairTruth& truth, double distance_m, const glm::dvec3& n) {
  EXPECT_NEAR(truth.distance_m, distance_m, 1e-9);
  expect_near(truth.n_world, n, 1e-9);
}

TEST(ContactSpheres, HaveTheDistanceOfTheirCentersMinusTheRadii) {
  Random random(900);
  for (const double apart_m : {2.5, 1.6, 1.4, 0.5}) {
    const glm::dvec3 to_second = random.direction();
    const PairTruth truth =
        truth_of(two_bodies(make_sphere(1.0, 3), make_sphere(0.5, 3), apart_m * to_second));
    // Faces lie below the sphere by less than a hundredth of its radius.
    EXPECT_GT(truth.distance_m, apart_m - 1.5 - 1e-6);
    EXPECT_LT(truth.distance_m, apart_m - 1.5 + 0.015);
    EXPECT_GT(glm::dot(truth.n_world, -to_second), std::cos(0.15));
  }
}

TEST(ContactBoxes, ApartInTheDirectionOfAFaceAnEdgeAndACorner) {
  const auto truth_at = [](const glm::dvec3& p) {
    return truth_of(two_bodies(make_box(cube_m), make_box(cube_m), p));
  };
  const PairTruth face = truth_at({5, 0.3, -0.2});
  expect_pair(face, 3.0, {-1, 0, 0});
  EXPECT_NEAR(face.p_first_m.x, 1.0, 1e-12);
  EXPECT_NEAR(face.p_second_m.x, 4.0, 1e-12);
  expect_pair(truth_at({4, 5, 0.1}), std::sqrt(13.0), -glm::dvec3(2, 3, 0) / std::sqrt(13.0));
  const PairTruth corner = truth_at({4, -5, 6});
  expect_pair(corner, std::sqrt(29.0), -glm::dvec3(2, -3, 4) / std::sqrt(29.0));
  expect_near(corner.p_first_m, {1, -1, 1});
  expect_near(corner.p_second_m, {3, -4, 5});
}

TEST(ContactBoxes, ApartByCrossedEdges) {
  // An edge of the first one along z is toward an edge of the second one along y.
  Scene scene = two_bodies(make_box(cube_m), make_box(cube_m), {4.0, 0.1, 0.2},
                           glm::angleAxis(0.25 * pi, glm::dvec3(0, 1, 0)));
  scene.entities[0].row.motion.q_world = glm::angleAxis(0.25 * pi, glm::dvec3(0, 0, 1));
  expect_pair(truth_of(scene), 4.0 - 2.0 * std::sqrt(2.0), {-1, 0, 0});
  scene.entities[1].row.motion.p_world_m.x = 2.0 * std::sqrt(2.0) - 0.25;
  expect_pair(truth_of(scene), -0.25, {-1, 0, 0});
}

TEST(ContactBoxes, PenetrateByTheShortestWayOut) {
  const auto truth_at = [](const glm::dvec3& p) {
    return truth_of(two_bodies(make_box(cube_m), make_box(cube_m), p));
  };
  const PairTruth one = truth_at({1.5, 0.2, 0.1});
  expect_pair(one, -0.5, {-1, 0, 0});
  const PairTruth two = truth_at({1.5, -1.5, 0.1});
  EXPECT_NEAR(two.distance_m, -0.5, 1e-12);
  const PairTruth touching = truth_at({2.0, 0.2, 0.1});
  EXPECT_NEAR(touching.distance_m, 0.0, 1e-12);
}

TEST(ContactBoxes, OnACornerOfATurnedBox) {
  // The diagonal from corner to corner is along z.
  const glm::dvec3 axis = glm::normalize(glm::cross(glm::dvec3(1, 1, 1), glm::dvec3(0, 0, 1)));
  const glm::dquat upright = glm::angleAxis(std::acos(1.0 / std::sqrt(3.0)), axis);
  for (const double apart_m : {0.25, -0.25}) {
    const Scene scene = two_bodies(make_box({20, 20, 1}), make_box(cube_m),
                                   {0.3, -0.2, 0.5 + std::sqrt(3.0) + apart_m}, upright);
    expect_pair(truth_of(scene), apart_m, {0, 0, -1});
  }
}

TEST(ContactBoxes, InsideAndCoincident) {
  Scene scene = two_bodies(make_box({10, 10, 10}), make_box({1, 1, 1}), {3, 0, 0});
  expect_pair(truth_of(scene), -2.5, {-1, 0, 0});
  scene.entities[1].row.motion.p_world_m = {0, 0, 0};
  EXPECT_NEAR(truth_of(scene).distance_m, -5.5, 1e-12);
  const PairTruth same = truth_of(two_bodies(make_box({2, 3, 4}), make_box({2, 3, 4}), {0, 0, 0}));
  EXPECT_NEAR(same.distance_m, -2.0, 1e-12);
  EXPECT_NEAR(std::abs(same.n_world.x), 1.0, 1e-12);
}

TEST(ContactThin, NeedleAndPlate) {
  Scene scene = two_bodies(make_box({20, 20, 0.1}), make_box({0.01, 0.01, 10}), {3, 2, 4.9});
  expect_pair(truth_of(scene), -0.15, {0, 0, -1});
  scene.entities[1].row.motion.p_world_m.z = 5.3;
  expect_pair(truth_of(scene), 0.25, {0, 0, -1});
  // Beside the plate's edge.
  scene.entities[1].row.motion.p_world_m = {10.105, 2.0, 0.0};
  expect_pair(truth_of(scene), 0.1, {-1, 0, 0});
}

TEST(ContactFlat, BodiesTouchAndPenetrate) {
  Scene scene = two_bodies(test::make_two_sided_rectangle(4, 4), make_box(cube_m), {0.2, 0.1, 1.5});
  expect_pair(truth_of(scene), 0.5, {0, 0, -1});
  scene.entities[1].row.motion.p_world_m.z = 0.9;
  expect_pair(truth_of(scene), -0.1, {0, 0, -1});
  scene.entities[1].row.motion.p_world_m = {2.9, 0.1, 0.2};
  expect_pair(truth_of(scene), -0.1, {-1, 0, 0});
  // Through the middle of the plane: out along z.
  scene.entities[1].row.motion.p_world_m = {0.0, 0.0, 0.2};
  expect_pair(truth_of(scene), -0.8, {0, 0, -1});
}

TEST(ContactFlat, BodiesInOnePlane) {
  Scene scene = two_bodies(test::make_two_sided_rectangle(4, 4), test::make_two_sided_rectangle(2, 2),
                           {4, 0.3, 0}, glm::angleAxis(0.5 * pi, glm::dvec3(0, 0, 1)));
  expect_pair(truth_of(scene), 1.0, {-1, 0, 0});
  scene.entities[1].row.motion.p_world_m.x = 2.0;
  EXPECT_NEAR(truth_of(scene).distance_m, 0.0, 1e-12);
  scene.entities[1].row.motion.p_world_m = {0.5, 0.3, -0.25};
  expect_pair(truth_of(scene), 0.25, {0, 0, 1});
  // Crossing planes.
  scene.entities[1].row.motion.q_world = glm::angleAxis(0.5 * pi, glm::dvec3(1, 0, 0));
  expect_pair(truth_of(scene), -0.75, {0, 0, 1});
}

TEST(ContactPose, FarFromTheOriginNothingIsLost) {
  const glm::dvec3 far_m{1e5, -1e5, 1e5};
  Scene scene = two_bodies(make_box(cube_m), make_box(cube_m), {2.0001, 0.3, 0.2});
  for (EntityState& state : scene.entities)
    state.row.motion.p_world_m += far_m;
  const PairTruth truth = truth_of(scene);
  EXPECT_NEAR(truth.distance_m, 0.0001, 1e-10);
  expect_near(truth.n_world, {-1, 0, 0}, 1e-9);
  EXPECT_LT(truth.precision_m, 1e-3);
}

TEST(ContactPose, IsScaledForEachAxis) {
  Scene scene = two_bodies(make_box(cube_m), make_box(cube_m), {0, 7, 0},
                           glm::angleAxis(0.5 * pi, glm::dvec3(0, 0, 1)));
  scene.entities[1].row.scale = {3.0, 0.5, 1.0};  // its long side is along y
  expect_pair(truth_of(scene), 3.0, {0, -1, 0});
  scene.entities[1].row.motion.p_world_m = {1.25, 0.1, 0.0};
  expect_pair(truth_of(scene), -0.25, {-1, 0, 0});
}

TEST(ContactPose, MeshesMayBeInsideOut) {
  TriangleMesh turned = make_box(cube_m);
  for (glm::uvec3& triangle : turned.triangles)
    std::swap(triangle.x, triangle.y);
  const Scene scene = two_bodies(turned, make_box(cube_m), {1.5, 0.2, 0.1});
  expect_pair(truth_of(scene), -0.5, {-1, 0, 0});
  EXPECT_NEAR(truth_of(scene).precision_m, contact_precision * std::sqrt(12.0), 1e-6);
  const ContactSearch search = search_of(first_id, second_id);
  const World world = scene.world();
  const Judgement judgement =
      compare(world, search, truth_of(scene), rounded(world, search, first_id, second_id));
  EXPECT_EQ(judgement.verdict, Verdict::agrees) << judgement.reason;
}

TEST(ContactPose, IsThatOfTheSearchsTime) {
  Scene scene = two_bodies(make_box({6, 2, 2}), make_box(cube_m), {10, 20, 0});
  Motion& first = scene.entities[0].row.motion;
  first.v_world_mps = {10, 0, 0};
  first.w_world_radps = {0, 0, 0.5 * pi};
  scene.entities[1].row.motion.v_world_mps = {0, -8, 0};
  // After a second the first one is at (10, 0, 0) with its long side along y, the second at (10, 12, 0).
  expect_pair(truth_of(scene, at_s(1.0)), 8.0, {0, -1, 0});
  scene.entities[1].row.motion.v_world_mps = {0, -16.5, 0};
  expect_pair(truth_of(scene, at_s(1.0)), -0.5, {0, -1, 0});
}

TEST(ContactNoise, IsThatOfTheSmallerBodyOrOfTheLargerOnesCoordinates) {
  const double diagonal_m = std::sqrt(12.0);
  EXPECT_NEAR(truth_of(two_bodies(make_box(cube_m), make_box({5, 5, 5}), {5, 0, 0})).precision_m,
              contact_precision * diagonal_m, 1e-7);
  const PairTruth large = truth_of(two_bodies(make_box(cube_m), make_box({20000, 10, 10}), {0, 6.5, 0}));
  EXPECT_EQ(large.precision_m, 8.0 * 0x1p-10);  // the unit of 10 km is a 1024th of a metre
  EXPECT_NEAR(large.distance_m, 0.5, 1e-9);
}

}  // namespace
}  // namespace rtstdb::oracle
