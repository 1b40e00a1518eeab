// Crossing, distance and depth of concave bodies: closed forms, and against sampling.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "surface_scene.hpp"

namespace rtstdb::oracle {
namespace {

using test::make_bowl;
using test::make_gear;
using test::make_hollow_sphere;
using test::make_l_shape;
using test::make_torus;
using test::make_wavy_sheet;

const glm::dquat quarter_about_x = glm::angleAxis(0.5 * pi, glm::dvec3(1.0, 0.0, 0.0));

TEST(ConcaveMeshes, AreClosedWithFrontsOutside) {
  for (const TriangleMesh& mesh : {make_torus(1.0, 0.3, 16), make_bowl(1.0, 0.8, 24),
                                   make_hollow_sphere(1.0, 0.8, 2), make_gear(1.0, 0.8, 0.4, 0.3, 9),
                                   make_l_shape(1.0, 0.3, 0.5), test::make_fingers(3, 0.2, 1.0, 0.5, 8)}) {
    const MeshTree tree(mesh);
    EXPECT_TRUE(tree.closed());
    EXPECT_FALSE(tree.inside_out());
    EXPECT_FALSE(tree.convex());
  }
  EXPECT_FALSE(MeshTree(make_wavy_sheet(1.0, 0.1, 8)).closed());
}

TEST(ConcaveMeshes, HaveTheVolumesOfTheirShapes) {
  const auto volume_m3 = [](const TriangleMesh& mesh) {
    double six_volumes = 0.0;
    for (const glm::uvec3& t : mesh.triangles)
      six_volumes +=
          glm::dot(glm::dvec3(mesh.positions_m[t.x]),
                   glm::cross(glm::dvec3(mesh.positions_m[t.y]), glm::dvec3(mesh.positions_m[t.z])));
    return six_volumes / 6.0;
  };
  EXPECT_NEAR(volume_m3(make_l_shape(1.0, 0.25, 0.5)), 0.5 * (2.0 * 0.25 - 0.0625), 1e-6);
  EXPECT_NEAR(volume_m3(make_torus(1.0, 0.3, 64)), 2.0 * pi * pi * 0.09, 0.01);
  EXPECT_NEAR(volume_m3(make_bowl(1.0, 0.8, 96)), 2.0 / 3.0 * pi * (1.0 - 0.512), 0.01);
  EXPECT_NEAR(volume_m3(make_hollow_sphere(1.0, 0.8, 4)), 4.0 / 3.0 * pi * (1.0 - 0.512), 0.01);
  EXPECT_GT(volume_m3(make_gear(1.0, 0.8, 0.4, 0.5, 12)), 0.5 * pi * (0.64 - 0.16) * 0.98);
  EXPECT_LT(volume_m3(make_gear(1.0, 0.8, 0.4, 0.5, 12)), 0.5 * pi * (1.0 - 0.16));
}

/// Two tori of which each passes through the hole of the other: the circles that the tubes follow are 1 m
/// apart.
TEST(SurfaceTruth, LinkedToriAreApart) {
  const Scene scene =
      two_bodies(make_torus(1.0, 0.3, 48), make_torus(1.0, 0.3, 48), {1.0, 0.0, 0.0}, quarter_about_x);
  const SurfaceTruth truth = surface_truth_of(scene);
  EXPECT_FALSE(truth.is_contact);
  EXPECT_TRUE(truth.has_depth);
  EXPECT_NEAR(truth.distance_m, 1.0 - 0.6, 0.01);
  EXPECT_EQ(truth.max_depth_m, 0.0);
}

/// The tubes of two tori that cross at a right angle, whose axes meet: the deepest points are on the axis of
/// the other tube. Corners of the mesh lie on the axis, and the tube's mesh is up to 0.3 (1 - cos(pi / 48))
/// within it.
TEST(SurfaceTruth, ToriWithTubesThatCross) {
  const Scene scene =
      two_bodies(make_torus(1.0, 0.3, 48), make_torus(1.0, 0.2, 48), {2.0, 0.0, 0.0}, quarter_about_x);
  const SurfaceTruth truth = surface_truth_of(scene);
  EXPECT_TRUE(truth.is_contact);
  EXPECT_GT(truth.crossing_margin_m, 1e-3);
  EXPECT_LE(truth.min_depth_m, truth.max_depth_m);
  EXPECT_NEAR(truth.min_depth_m, 0.3, 0.01);
  EXPECT_LE(truth.max_depth_m - truth.min_depth_m, 5e-4 * truth.smaller_diagonal_m + 1e-9);
}

TEST(SurfaceTruth, BallInABowl) {
  const double radius_m = 0.5;
  const auto at_height = [&](double z) {
    Scene scene = two_bodies(make_sphere(radius_m, 4), make_bowl(1.0, 0.8, 64), glm::dvec3(0.0));
    scene.entities[0].row.motion.p_world_m.z = z;
    return surface_truth_of(scene);
  };
  // In the cavity: from the ball's lowest point to the inner surface.
  const SurfaceTruth apart = at_height(-0.2);
  EXPECT_FALSE(apart.is_contact);
  EXPECT_NEAR(apart.distance_m, 0.8 - 0.2 - radius_m, 0.005);
  // The convex hull of the bowl contains the ball at both places.
  const SurfaceTruth touching = at_height(-0.35);
  EXPECT_TRUE(touching.is_contact);
  EXPECT_NEAR(touching.min_depth_m, 0.05, 0.005);
  EXPECT_NEAR(touching.p_first_m.z, -radius_m, 0.01);
}

TEST(SurfaceTruth, BallInTheHoleOfATorus) {
  Scene scene = two_bodies(make_torus(1.0, 0.3, 64), make_sphere(0.5, 4), glm::dvec3(0.0));
  EXPECT_NEAR(surface_truth_of(scene).distance_m, 1.0 - 0.3 - 0.5, 0.003);
  scene.entities[1].row.scale = glm::dvec3(1.5);
  const SurfaceTruth touching = surface_truth_of(scene);
  EXPECT_TRUE(touching.is_contact);
  EXPECT_NEAR(touching.min_depth_m, 0.75 - 0.7, 0.004);
}

/// A sphere in the cavity of a shell, in the wall, and around the whole.
TEST(SurfaceTruth, SphereAndHollowSphere) {
  const auto with_radius = [](double radius_m, const glm::dvec3& at_m) {
    return surface_truth_of(two_bodies(make_sphere(radius_m, 4), make_hollow_sphere(2.0, 1.0, 4), at_m));
  };
  const SurfaceTruth in_cavity = with_radius(0.6, {0.1, 0.0, 0.0});
  EXPECT_FALSE(in_cavity.is_contact);
  EXPECT_NEAR(in_cavity.distance_m, 0.3, 0.005);
  const SurfaceTruth in_wall = with_radius(0.3, {1.5, 0.0, 0.0});
  EXPECT_TRUE(in_wall.is_contact);
  EXPECT_GT(in_wall.distance_m, 0.15);
  EXPECT_EQ(in_wall.crossing_margin_m, 0.0);
  EXPECT_NEAR(in_wall.min_depth_m, 0.5, 0.01);
  // Of the shell's inner surface, within the larger sphere.
  const SurfaceTruth around = with_radius(3.0, glm::dvec3(0.0));
  EXPECT_TRUE(around.is_contact);
  EXPECT_NEAR(around.min_depth_m, 2.0, 0.01);
}

/// The end of each arm is above the other shape's arm, by 0.05 m; then it is as deep in it.
TEST(SurfaceTruth, LShapes) {
  const glm::dquat half_turn = glm::angleAxis(pi, glm::dvec3(0.0, 0.0, 1.0));
  const auto at_m = [&](const glm::dvec3& p_m) {
    return surface_truth_of(
        two_bodies(make_l_shape(1.0, 0.25, 0.5), make_l_shape(1.0, 0.25, 0.5), p_m, half_turn));
  };
  const SurfaceTruth apart = at_m({1.15, 1.3, 0.1});
  EXPECT_FALSE(apart.is_contact);
  EXPECT_NEAR(apart.distance_m, 0.05, 1e-6);
  const SurfaceTruth in_arm = at_m({1.15, 1.2, 0.1});
  EXPECT_TRUE(in_arm.is_contact);
  EXPECT_NEAR(in_arm.min_depth_m, 0.05, 1e-3);
  // The lower and upper faces are in the same planes: no edge pierces a triangle.
  const SurfaceTruth in_plane = at_m({1.15, 1.2, 0.0});
  EXPECT_TRUE(in_plane.is_contact);
  EXPECT_NEAR(in_plane.min_depth_m, 0.05, 1e-3);
}

/// The box stands on the shape, with and without a gap that rounding does not resolve.
TEST(SurfaceTruth, FacesThatTouchHaveNoDepth) {
  for (const double gap_m : {0.0, 1e-9}) {
    const SurfaceTruth truth = surface_truth_of(
        two_bodies(make_l_shape(2.0, 0.5, 1.0), make_box({0.25, 0.25, 0.25}), {1.0, 0.25, 1.125 + gap_m}));
    EXPECT_NEAR(truth.distance_m, gap_m, 1e-12);
    EXPECT_EQ(truth.is_contact, gap_m == 0.0);
    EXPECT_LE(truth.min_depth_m, 1e-9);
    EXPECT_FALSE(truth.is_certain_contact());
  }
}

/// A plate whose edge pierces a triangle alone: no corner of the bodies is inside the other.
TEST(SurfaceTruth, EdgesThatCross) {
  TriangleMesh first = make_wavy_sheet(2.0, 0.0, 2);
  const Scene scene = two_bodies(first, first, {0.9, 0.3, 0.2}, quarter_about_x);
  const SurfaceTruth truth = surface_truth_of(scene);
  EXPECT_TRUE(truth.is_contact);
  EXPECT_FALSE(truth.has_depth);
  EXPECT_EQ(truth.max_depth_m, 0.0);
  EXPECT_GT(truth.crossing_margin_m, 0.05);
  EXPECT_NEAR(truth.p_first_m.z, 0.0, 1e-9);
  EXPECT_NEAR(truth.p_first_m.y, 0.3, 1e-6);
}

TEST(SurfaceTruth, CrossingMarginIsTheShortestTranslationThatUndoesIt) {
  // The lower edge of an upright triangle pierces a larger one, 0.02 m from its end.
  const TriangleMesh ground{{{-1, -1, 0}, {2, -1, 0}, {-1, 2, 0}}, {{0, 1, 2}}};
  const TriangleMesh upright{{{0, 0, -0.02f}, {0, 0.01f, 1}, {0, -0.01f, 1}}, {{0, 1, 2}}};
  const SurfaceTruth truth = surface_truth_of(two_bodies(ground, upright, glm::dvec3(0.0)));
  EXPECT_TRUE(truth.is_contact);
  EXPECT_NEAR(truth.crossing_margin_m, 0.02, 1e-6);
  const SurfaceTruth above = surface_truth_of(two_bodies(ground, upright, {0.0, 0.0, 0.03}));
  EXPECT_FALSE(above.is_contact);
  EXPECT_NEAR(above.distance_m, 0.01, 1e-6);
}

/// A thin plate through a ring, not in contact, and then in contact with its inside.
TEST(SurfaceTruth, PlateThroughARing) {
  const auto with_width = [](double width_m) {
    return surface_truth_of(
        two_bodies(make_torus(1.0, 0.2, 48), make_box({width_m, 0.02, 4.0}), glm::dvec3(0.0)));
  };
  EXPECT_FALSE(with_width(1.4).is_contact);
  EXPECT_NEAR(with_width(1.4).distance_m, 0.1, 0.005);
  const SurfaceTruth touching = with_width(1.8);
  EXPECT_TRUE(touching.is_contact);
  // The edges of the plate are at 0.9 m; the tube begins at 0.8 m.
  EXPECT_NEAR(touching.min_depth_m, 0.1, 0.01);
}

/// An open sheet has no inside, but its points are inside a closed body.
TEST(SurfaceTruth, SheetInATorus) {
  const Scene scene = two_bodies(make_torus(1.0, 0.4, 48), make_wavy_sheet(0.2, 0.0, 4), {1.0, 0.0, 0.1});
  const SurfaceTruth truth = surface_truth_of(scene);
  EXPECT_TRUE(truth.is_contact);
  EXPECT_TRUE(truth.has_depth);
  EXPECT_EQ(truth.crossing_margin_m, 0.0);
  EXPECT_NEAR(truth.min_depth_m, 0.3, 0.015);
}

TEST(SurfaceTruth, DeformingGeometryHasTheInsideOfItsShape) {
  const Scene scene = two_bodies(make_sphere(1.0, 2), make_sphere(1.0, 2), {0.5, 0.0, 0.0});
  World world = scene.world();
  EXPECT_FALSE(is_surface_pair(world, first_id, second_id));
  world.mark_deforming({1});
  EXPECT_TRUE(is_surface_pair(world, first_id, second_id));
  world.mark_deforming({0});
  const SurfaceTruth truth = surface_truth(world, first_id, second_id, {});
  EXPECT_TRUE(truth.is_contact);
  EXPECT_TRUE(truth.has_depth);
}

/// Against all pairs of triangles, and against points of the surfaces at random, whose depth is found with
/// another search and the sum of solid angles.
TEST(SurfaceTruth, AgreesWithSampling) {
  constexpr int pairs = 60;
  const Scene scene = concave_pairs(77, pairs);
  const World world = scene.world();
  Random random(5);
  int contacts = 0;
  int apart = 0;
  for (std::uint32_t i = 0; i < 2 * pairs; i += 2) {
    SCOPED_TRACE(i);
    const SurfacePair pair(world, {i, 1}, {i + 1, 1}, {});
    const SurfaceTruth truth = surface_truth(pair);
    ++(truth.is_contact ? contacts : apart);
    EXPECT_LE(truth.max_depth_m - truth.min_depth_m,
              5.1e-4 * truth.smaller_diagonal_m + 0.0021 * truth.max_depth_m);
    double nearest_m = std::numeric_limits<double>::infinity();
    double deepest_m = 0.0;
    for (const bool swapped : {false, true}) {
      const SurfaceBody& surface = swapped ? pair.second_surface : pair.first_surface;
      const SurfaceBody& body = swapped ? pair.first_surface : pair.second_surface;
      for (int sample = 0; sample < 300; ++sample) {
        const auto& c = surface.triangles()[random.below(surface.triangles().size())];
        double u = random.uniform(0.0, 1.0);
        double v = random.uniform(0.0, 1.0);
        if (u + v > 1.0) std::tie(u, v) = std::pair(1.0 - u, 1.0 - v);
        const glm::dvec3 p = (1.0 - u - v) * c[0] + u * c[1] + v * c[2];
        double distance_m = std::numeric_limits<double>::infinity();
        for (const auto& triangle : body.triangles())
          distance_m = std::min(distance_m, glm::distance(nearest_on_triangle(triangle, p).point, p));
        EXPECT_NEAR(body.nearest(p).distance_m, distance_m, 1e-9);
        nearest_m = std::min(nearest_m, distance_m);
        double solid_angle = 0.0;
        for (const auto& [a, b, e] : body.triangles()) {
          const glm::dvec3 pa = glm::normalize(a - p);
          const glm::dvec3 pb = glm::normalize(b - p);
          const glm::dvec3 pe = glm::normalize(e - p);
          solid_angle += 2.0 * std::atan2(glm::dot(pa, glm::cross(pb, pe)),
                                          1.0 + glm::dot(pa, pb) + glm::dot(pb, pe) + glm::dot(pe, pa));
        }
        const bool is_inside = body.has_inside() && std::abs(solid_angle) > 2.0 * pi;
        EXPECT_EQ(body.is_inside(p), is_inside);
        if (is_inside) deepest_m = std::max(deepest_m, distance_m);
      }
    }
    EXPECT_LE(deepest_m, truth.max_depth_m + 1e-9);
    EXPECT_GE(nearest_m, truth.distance_m - 1e-9);
    if (!truth.is_contact) {
      EXPECT_EQ(deepest_m, 0.0);
      EXPECT_NEAR(glm::distance(truth.p_first_m, truth.p_second_m), truth.distance_m, 1e-9);
    }
  }
  EXPECT_GT(contacts, pairs / 4);
  EXPECT_GT(apart, pairs / 8);
}

}  // namespace
}  // namespace rtstdb::oracle
