// Contacts of bodies that do not consist of convex parts, whose answers are known in closed form. Each answer
// is also compared with the oracle.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/gpu/database_fixture.hpp"
#include "tests/support/concave_meshes.hpp"

namespace rtstdb::test {
namespace {

const glm::dquat upright = glm::angleAxis(0.5 * std::numbers::pi, glm::dvec3(1.0, 0.0, 0.0));

/// The parameter: bodies have a distance field.
class SurfaceContacts : public DatabaseTest, public testing::WithParamInterface<bool> {
 protected:
  EntityId body(const TriangleMesh& mesh, const glm::dvec3& p_m = glm::dvec3(0.0),
                const glm::dquat& q = {1.0, 0.0, 0.0, 0.0}) {
    GeometryOptions options;
    if (GetParam()) options.field.emplace();
    return body_of(mesh, options, p_m, q);
  }
  EntityId deforming_body(const TriangleMesh& mesh, const glm::dvec3& p_m = glm::dvec3(0.0)) {
    return body_of(mesh, {.deforms = true}, p_m, {1.0, 0.0, 0.0, 0.0});
  }
  ContactPair pair(EntityId first, EntityId second, float margin_m = 0.0f) {
    const ContactQueryOptions options{.name = "surfaces", .capacity = 1};
    const auto query = prepare(options);
    if (!query) return {};
    query->searches()[0] = {.first = first, .second = second, .margin_m = margin_m};
    const Outcome outcome = run(*query, 1);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    judge(world(), query->searches(), query->answers(), options);
    const ContactAnswer& answer = query->answers()[0];
    EXPECT_EQ(answer.pairs.size(), 1u);
    return answer.pairs.empty() ? ContactPair{} : answer.pairs[0];
  }

 private:
  EntityId body_of(const TriangleMesh& mesh, const GeometryOptions& options, const glm::dvec3& p_m,
                   const glm::dquat& q) {
    const auto geometry = database().add_geometry(mesh, "body" + std::to_string(count_++), options);
    EXPECT_TRUE(geometry.ok()) << (geometry.ok() ? "" : geometry.error().message);
    if (!geometry) return {};
    EntityRow row = row_of(geometry.value(), p_m);
    row.motion.q_world = q;
    return create(row);
  }

  int count_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Fields, SurfaceContacts, testing::Bool(), [](const auto& of_case) {
  return std::string(of_case.param ? "with_field" : "without_field");
});

void expect_contact(const ContactPair& found, double depth_m, double tolerance_m) {
  EXPECT_EQ(found.status, PairStatus::contact);
  EXPECT_TRUE(found.has_depth);
  EXPECT_NEAR(-static_cast<double>(found.distance_m), depth_m, tolerance_m);
  ASSERT_GT(found.point_count, 0u);
  EXPECT_FLOAT_EQ(found.points[0].depth_m, -found.distance_m);
  EXPECT_EQ(found.points[0].n_world, found.n_world);
}

void expect_apart(const ContactPair& found, double distance_m, double tolerance_m) {
  EXPECT_EQ(found.status, PairStatus::separate);
  EXPECT_NEAR(static_cast<double>(found.distance_m), distance_m, tolerance_m);
  EXPECT_EQ(found.point_count, 0u);
}

/// Each torus passes through the hole of the other, whose convex hull it penetrates.
TEST_P(SurfaceContacts, LinkedToriAreApart) {
  const TriangleMesh torus = make_torus(1.0, 0.3, 24);
  expect_apart(pair(body(torus), body(torus, {1.0, 0.0, 0.0}, upright)), 0.4, 0.02);
}

TEST_P(SurfaceContacts, TubesOfToriThatCross) {
  const EntityId first = body(make_torus(1.0, 0.3, 24));
  const EntityId second = body(make_torus(1.0, 0.2, 24), {2.0, 0.0, 0.0}, upright);
  // A point on the axis of the first tube is as deep as its radius.
  expect_contact(pair(first, second), 0.3, 0.02);
}

TEST_P(SurfaceContacts, BallInABowl) {
  const TriangleMesh bowl = make_bowl(1.0, 0.8, 48);
  const TriangleMesh ball = make_sphere(0.5, 3);
  expect_apart(pair(body(ball, {0.0, 0.0, -0.2}), body(bowl)), 0.1, 0.01);
  const ContactPair touching = pair(body(ball, {0.0, 0.0, -0.35}), body(bowl));
  expect_contact(touching, 0.05, 0.01);
  EXPECT_GT(touching.n_world.z, 0.9f);
  const ContactPair near = pair(body(ball, {0.0, 0.0, -0.2}), body(bowl), 0.15f);
  EXPECT_EQ(near.status, PairStatus::near);
  EXPECT_GT(near.n_world.z, 0.9f);
  ASSERT_GT(near.point_count, 0u);
  EXPECT_FLOAT_EQ(near.points[0].depth_m, -near.distance_m);
}

TEST_P(SurfaceContacts, BallInTheHoleOfATorus) {
  const TriangleMesh torus = make_torus(1.0, 0.3, 32);
  expect_apart(pair(body(make_sphere(0.5, 3)), body(torus)), 0.2, 0.01);
  expect_contact(pair(body(make_sphere(0.75, 3)), body(torus)), 0.05, 0.012);
}

/// The surfaces do not cross in any of these cases.
TEST_P(SurfaceContacts, BodyInTheCavityAndInTheWallOfAnother) {
  const TriangleMesh hollow = make_hollow_sphere(2.0, 1.0, 3);
  expect_apart(pair(body(make_sphere(0.6, 3), {0.1, 0.0, 0.0}), body(hollow)), 0.3, 0.02);
  expect_contact(pair(body(make_sphere(0.3, 3), {1.5, 0.0, 0.0}), body(hollow)), 0.5, 0.02);
  // The inner surface is deepest in the sphere around the shell.
  expect_contact(pair(body(make_sphere(3.0, 3)), body(hollow)), 2.0, 0.05);
}

/// The end of each arm is above the other shape's arm, by 0.05 m; then it is as deep in it.
TEST_P(SurfaceContacts, LShapes) {
  const TriangleMesh shape = make_l_shape(1.0, 0.25, 0.5);
  const glm::dquat half_turn = glm::angleAxis(std::numbers::pi, glm::dvec3(0.0, 0.0, 1.0));
  expect_apart(pair(body(shape), body(shape, {1.15, 1.3, 0.1}, half_turn)), 0.05, 1e-4);
  expect_contact(pair(body(shape), body(shape, {1.15, 1.2, 0.1}, half_turn)), 0.05, 0.004);
  // The lower and upper faces are in the same planes: no edge pierces a triangle.
  expect_contact(pair(body(shape), body(shape, {1.15, 1.2, 0.0}, half_turn)), 0.05, 0.004);
}

TEST_P(SurfaceContacts, PlateThroughARing) {
  const TriangleMesh ring = make_torus(1.0, 0.2, 32);
  expect_apart(pair(body(make_box({1.4, 0.02, 4.0})), body(ring)), 0.1, 0.01);
  expect_contact(pair(body(make_box({1.8, 0.02, 4.0})), body(ring)), 0.1, 0.012);
}

TEST_P(SurfaceContacts, ScaledPerAxis) {
  const TriangleMesh torus = make_torus(1.0, 0.3, 32);
  const EntityId ball = body(make_sphere(0.5, 3));
  const EntityId ring = body(torus);
  oracle::World rows = world();
  EntityRow wide = rows.find(ring)->row;
  wide.scale = {2.0, 1.0, 1.0};
  EntityRow high = rows.find(ball)->row;
  high.scale = {1.0, 1.0, 3.0};
  // Along y the hole has kept its size.
  expect_apart(pair(create(high), create(wide)), 0.2, 0.01);
  high.scale.y = 1.5;
  expect_contact(pair(create(high), create(wide)), 0.05, 0.012);
}

TEST_P(SurfaceContacts, FarFromTheOrigin) {
  const glm::dvec3 far_m(99'000.0, -98'000.0, 97'000.0);
  const TriangleMesh shape = make_l_shape(1.0, 0.25, 0.5);
  const EntityId first = body(shape, far_m);
  const EntityId second = body(make_box({0.2, 0.2, 0.2}), far_m + glm::dvec3(0.6, 0.33, 0.25));
  expect_contact(pair(first, second), 0.02, 0.001);
}

/// A sheet has no inside, but its points are inside a closed body.
TEST_P(SurfaceContacts, OpenSheetInATorus) {
  const EntityId torus = body(make_torus(1.0, 0.4, 32));
  const EntityId sheet = body(make_wavy_sheet(0.2, 0.0, 4), {1.0, 0.0, 0.1});
  expect_contact(pair(torus, sheet), 0.3, 0.015);
  expect_contact(pair(sheet, torus), 0.3, 0.015);
}

TEST_P(SurfaceContacts, OpenSheetsHaveNoDepth) {
  const TriangleMesh sheet = make_wavy_sheet(2.0, 0.0, 4);
  const EntityId first = body(sheet);
  const ContactPair found = pair(first, body(sheet, {0.9, 0.3, 0.2}, upright));
  EXPECT_EQ(found.status, PairStatus::contact);
  EXPECT_FALSE(found.has_depth);
  EXPECT_EQ(found.distance_m, 0.0f);
  ASSERT_GT(found.point_count, 0u);
  for (const ContactPoint& point : found.contacts()) {
    EXPECT_EQ(point.depth_m, 0.0f);
    EXPECT_NEAR(point.p_first_m.z, 0.0f, 3e-4f);
    EXPECT_NEAR(point.p_first_m.y, 0.3f, 3e-4f);
  }
  const ContactPair above = pair(first, body(sheet, {0.4, 0.1, 0.25}));
  expect_apart(above, 0.25, 3e-4);
  EXPECT_FALSE(above.has_depth);
}

TEST_P(SurfaceContacts, DeformingBodiesHaveTheInsideOfTheirShape) {
  const EntityId closed = deforming_body(make_sphere(1.0, 2));
  const ContactPair crossing = pair(closed, body(make_wavy_sheet(4.0, 0.0, 6), {0.1, 0.1, 0.3}));
  EXPECT_EQ(crossing.status, PairStatus::contact);
  EXPECT_TRUE(crossing.has_depth);
  EXPECT_NEAR(crossing.distance_m, -0.69f, 0.03f);
  expect_contact(pair(closed, body(make_torus(1.5, 0.6, 32))), 0.1, 0.05);
  EXPECT_EQ(pair(closed, body(make_wavy_sheet(0.5, 0.0, 4))).status, PairStatus::contact);
  const EntityId open = deforming_body(make_wavy_sheet(4.0, 0.0, 6), {0.0, 0.0, 5.0});
  const ContactPair without = pair(open, body(make_rectangle(1.0, 1.0), {0.0, 0.0, 5.0}, upright));
  EXPECT_EQ(without.status, PairStatus::contact);
  EXPECT_FALSE(without.has_depth);
  EXPECT_EQ(without.distance_m, 0.0f);
}

TEST_P(SurfaceContacts, PairsOfMasksAreListedOnceAndInOrder) {
  const TriangleMesh torus = make_torus(1.0, 0.3, 16);
  const EntityId first = body(torus);
  body(torus, {1.0, 0.0, 0.0}, upright);
  const EntityId ball = body(make_sphere(0.5, 2), {1.0, 0.9, 0.0});
  const ContactQueryOptions options{.name = "masks", .capacity = 1};
  const auto query = prepare(options);
  ASSERT_NE(query, nullptr);
  query->searches()[0] = ContactSearch{};
  ASSERT_TRUE(run(*query, 1).done());
  judge(world(), query->searches(), query->answers(), options);
  const ContactAnswer& answer = query->answers()[0];
  EXPECT_EQ(answer.candidates, 2u) << "the ball is beside the bounds of the linked torus";
  ASSERT_EQ(answer.pairs.size(), 1u);
  EXPECT_EQ(answer.pairs[0].first, first);
  EXPECT_EQ(answer.pairs[0].second, ball);
}

}  // namespace
}  // namespace rtstdb::test
