// Contacts whose answers are known in closed form, and what a contact query lists.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/expect_vector.hpp"
#include "tests/support/hull_meshes.hpp"

namespace rtstdb::test {
namespace {

/// An answer without references.
struct Answered {
  std::vector<ContactPair> pairs;
  std::uint32_t found = 0, candidates = 0;
  bool overflow = false;
};

class ContactTest : public DatabaseTest {
 protected:
  Answered search(const ContactSearch& one, ContactQueryOptions options = {}) {
    options.name = "contacts";
    options.capacity = 1;
    const auto query = prepare(options);
    if (!query) return {};
    query->searches()[0] = one;
    const Outcome outcome = run(*query, 1);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    const ContactAnswer& answer = query->answers()[0];
    EXPECT_FALSE(answer.incomplete);
    return {{answer.pairs.begin(), answer.pairs.end()}, answer.found, answer.candidates, answer.overflow};
  }
  ContactPair pair(EntityId first, EntityId second, float margin_m = 0.0f, WorldTime t = {}) {
    const Answered answered = search({.first = first, .second = second, .t = t, .margin_m = margin_m});
    EXPECT_EQ(answered.pairs.size(), 1u);
    if (answered.pairs.size() != 1) return {};
    EXPECT_EQ(answered.pairs[0].first, first);
    EXPECT_EQ(answered.pairs[0].second, second);
    return answered.pairs[0];
  }
  GeometryId cube() {
    if (!cube_.valid()) cube_ = add(make_box({1.0, 1.0, 1.0}));
    return cube_;
  }
  EntityId cube_at(const glm::dvec3& p_m, const glm::dquat& q = {1.0, 0.0, 0.0, 0.0}) {
    EntityRow row = row_of(cube(), p_m);
    row.motion.q_world = q;
    return create(row);
  }

 private:
  GeometryId cube_;
};

TEST_F(ContactTest, TwoCubesThatAreApart) {
  const EntityId first = cube_at({0.0, 0.0, 0.0});
  const EntityId second = cube_at({1.25, 0.3, 0.0});
  const ContactPair found = pair(first, second);
  EXPECT_EQ(found.status, PairStatus::separate);
  EXPECT_NEAR(found.distance_m, 0.25f, 1e-5f);
  EXPECT_NEAR(found.min_distance_m, 0.25f, 1e-4f);
  EXPECT_NEAR(found.max_distance_m, 0.25f, 1e-4f);
  expect_near(found.n_world, {-1.0, 0.0, 0.0}, 1e-3);
  EXPECT_EQ(found.point_count, 0u);
}

TEST_F(ContactTest, DistancesBetweenCornersAndEdges) {
  const EntityId first = cube_at({0.0, 0.0, 0.0});
  const EntityId by_corner = cube_at({1.1, 1.2, 1.2});
  const EntityId by_edge = cube_at({1.3, -1.4, 0.2});
  EXPECT_NEAR(pair(first, by_corner).distance_m, 0.3f, 1e-5f);
  expect_near(pair(first, by_corner).n_world, glm::dvec3(-1.0, -2.0, -2.0) / 3.0, 1e-3);
  EXPECT_NEAR(pair(first, by_edge).distance_m, 0.5f, 1e-5f);
  expect_near(pair(first, by_edge).n_world, {-0.6, 0.8, 0.0}, 1e-3);
}

/// The face of one cube on that of another: four points at the corners of the common part.
TEST_F(ContactTest, CubeThatStandsOnACube) {
  const EntityId lower = cube_at({0.0, 0.0, 0.0});
  const EntityId upper = cube_at({0.4, 0.2, 0.98});
  const ContactPair found = pair(upper, lower);
  EXPECT_EQ(found.status, PairStatus::contact);
  EXPECT_NEAR(found.distance_m, -0.02f, 1e-5f);
  expect_near(found.n_world, {0.0, 0.0, 1.0}, 1e-4);
  ASSERT_EQ(found.point_count, 4u);
  std::vector<glm::dvec3> corners{
      {-0.5, -0.5, -0.49}, {0.1, -0.5, -0.49}, {-0.5, 0.3, -0.49}, {0.1, 0.3, -0.49}};
  for (const ContactPoint& point : found.contacts()) {
    EXPECT_NEAR(point.depth_m, 0.02f, 1e-5f);
    const auto near = std::ranges::min_element(corners, {}, [&](const glm::dvec3& corner) {
      return glm::length(corner - glm::dvec3(point.p_first_m));
    });
    ASSERT_NE(near, corners.end());
    expect_near(point.p_first_m, *near, 1e-4);
    corners.erase(near);
  }
}

TEST_F(ContactTest, MarginListsPairsThatAreApart) {
  const EntityId lower = cube_at({0.0, 0.0, 0.0});
  const EntityId upper = cube_at({0.0, 0.0, 1.03});
  EXPECT_EQ(pair(upper, lower).status, PairStatus::separate);
  const ContactPair found = pair(upper, lower, 0.05f);
  EXPECT_EQ(found.status, PairStatus::near);
  EXPECT_NEAR(found.distance_m, 0.03f, 1e-5f);
  ASSERT_EQ(found.point_count, 4u);
  for (const ContactPoint& point : found.contacts()) {
    EXPECT_NEAR(point.depth_m, -0.03f, 1e-5f);
    EXPECT_NEAR(point.p_first_m.z, -0.515f, 1e-5f);
  }
}

/// A cube on its edge: two points at the ends of the edge. On its corner: one point.
TEST_F(ContactTest, CubeOnItsEdgeAndOnItsCorner) {
  const EntityId ground = create(row_of(add(make_box({10.0, 10.0, 1.0})), {0.0, 0.0, -0.5}));
  const double root = std::numbers::sqrt2;
  const EntityId on_edge = cube_at({-2.0, 0.0, 0.5 * root - 0.01},
                                   glm::angleAxis(0.25 * std::numbers::pi, glm::dvec3(1.0, 0.0, 0.0)));
  // Turns the diagonal upright.
  const glm::dquat upright =
      glm::angleAxis(std::acos(1.0 / std::numbers::sqrt3), glm::normalize(glm::dvec3(1.0, -1.0, 0.0)));
  const EntityId on_corner = cube_at({2.0, 0.0, 0.5 * std::numbers::sqrt3 - 0.01}, upright);
  const ContactPair edge = pair(on_edge, ground);
  EXPECT_NEAR(edge.distance_m, -0.01f, 1e-5f);
  expect_near(edge.n_world, {0.0, 0.0, 1.0}, 1e-3);
  ASSERT_EQ(edge.point_count, 2u);
  EXPECT_NEAR(std::abs(edge.points[0].p_first_m.x - edge.points[1].p_first_m.x), 1.0f, 1e-3f);
  const ContactPair corner = pair(on_corner, ground);
  EXPECT_NEAR(corner.distance_m, -0.01f, 1e-5f);
  EXPECT_EQ(corner.point_count, 1u);
  expect_near(corner.points[0].p_first_m, {0.0, 0.0, -0.5 * std::numbers::sqrt3 + 0.005}, 1e-4);
}

TEST_F(ContactTest, Spheres) {
  const GeometryId sphere = add(make_sphere(1.0, 5));
  EXPECT_TRUE(database().geometry_info(sphere)->convex);
  const EntityId first = create(row_of(sphere));
  const glm::dvec3 along = glm::normalize(glm::dvec3(1.0, 2.0, -0.7));
  const EntityId apart = create(row_of(sphere, 2.5 * along));
  const EntityId deep = create(row_of(sphere, -1.6 * along));
  // The mesh is up to 0.0005 inside the sphere.
  const ContactPair far = pair(first, apart);
  EXPECT_NEAR(far.distance_m, 0.5f, 2e-3f);
  expect_near(far.n_world, -along, 0.02);
  const ContactPair near = pair(first, deep);
  EXPECT_EQ(near.status, PairStatus::contact);
  EXPECT_NEAR(near.distance_m, -0.4f, 2e-3f);
  expect_near(near.n_world, along, 0.04);
}

TEST_F(ContactTest, BodiesThatCoincideAndBodiesInsideOthers) {
  const EntityId first = cube_at({0.0, 0.0, 0.0});
  const EntityId same = cube_at({0.0, 0.0, 0.0});
  const EntityId hall = create(row_of(add(make_box({8.0, 6.0, 4.0})), {0.5, 0.0, 0.25}));
  const ContactPair coincident = pair(first, same);
  EXPECT_EQ(coincident.status, PairStatus::contact);
  EXPECT_NEAR(coincident.distance_m, -1.0f, 1e-4f);
  EXPECT_NEAR(glm::length(coincident.n_world), 1.0f, 1e-5f);
  const ContactPair inside = pair(first, hall);
  EXPECT_NEAR(inside.distance_m, -(2.0f + 0.5f - 0.25f), 1e-4f);
  expect_near(inside.n_world, {0.0, 0.0, -1.0}, 1e-3);
}

TEST_F(ContactTest, NeedleAndPlate) {
  const EntityId plate = create(row_of(add(make_box({20.0, 20.0, 0.001}))));
  const EntityId needle = create(row_of(add(make_box({0.001, 0.001, 2.0})), {3.0, -4.0, 0.9}));
  const ContactPair found = pair(needle, plate);
  EXPECT_EQ(found.status, PairStatus::contact);
  EXPECT_NEAR(found.distance_m, -0.1005f, 2e-4f);
  expect_near(found.n_world, {0.0, 0.0, 1.0}, 1e-3);
}

TEST_F(ContactTest, FlatBodies) {
  const GeometryId sheet = add(make_two_sided_rectangle(4.0, 4.0));
  EXPECT_TRUE(database().geometry_info(sheet)->convex);
  EXPECT_EQ(database().geometry_info(sheet)->hull_corners, 4u);
  const EntityId first = create(row_of(sheet));
  const EntityId box = cube_at({0.5, 0.0, 0.3});
  const ContactPair in_box = pair(box, first);
  EXPECT_NEAR(in_box.distance_m, -0.2f, 1e-4f);
  expect_near(in_box.n_world, {0.0, 0.0, 1.0}, 1e-3);
  EXPECT_EQ(in_box.point_count, 4u);
  const EntityId above = create(row_of(sheet, {1.0, 2.0, 0.25}));
  EXPECT_NEAR(pair(above, first).distance_m, 0.25f, 1e-5f);
  const EntityId in_plane = create(row_of(sheet, {1.0, 2.0, 0.0}));
  const ContactPair flat = pair(in_plane, first);
  EXPECT_EQ(flat.status, PairStatus::contact);
  EXPECT_NEAR(flat.distance_m, 0.0f, 1e-5f);
  EXPECT_NEAR(std::abs(flat.n_world.z), 1.0f, 1e-4f);
}

TEST_F(ContactTest, ParallelEdgesAndTouchingCorners) {
  const glm::dquat on_edge = glm::angleAxis(0.25 * std::numbers::pi, glm::dvec3(1.0, 0.0, 0.0));
  const EntityId first = cube_at({0.0, 0.0, 0.0}, on_edge);
  // Its lower edge lies on the upper one of the first cube, half a metre along.
  const EntityId second = cube_at({0.5, 0.0, std::numbers::sqrt2 - 0.02}, on_edge);
  const ContactPair edges = pair(second, first);
  EXPECT_EQ(edges.status, PairStatus::contact);
  // Along the normal of a face, which is the shortest way.
  EXPECT_NEAR(edges.distance_m, -0.02f / std::numbers::sqrt2_v<float>, 1e-4f);
  const EntityId by_corner = cube_at({1.0, 1.0, 1.0});
  const EntityId corner_of = cube_at({0.0, 0.0, 0.0});
  EXPECT_NEAR(pair(by_corner, corner_of).distance_m, 0.0f, 1e-4f);
}

/// 100 km from the origin single precision resolves 8 mm, and a pair is as precise as near it.
TEST_F(ContactTest, FarFromTheOrigin) {
  const glm::dvec3 far_m(99'000.0, -98'000.0, 97'000.0);
  const EntityId lower = cube_at(far_m);
  const EntityId upper = cube_at(far_m + glm::dvec3(0.0, 0.0, 0.999));
  const ContactPair found = pair(upper, lower);
  EXPECT_NEAR(found.distance_m, -0.001f, 1e-5f);
  const Answered listed = search({.first_mask = mask_all, .second_mask = mask_all});
  EXPECT_EQ(listed.pairs.size(), 1u);
}

TEST_F(ContactTest, SizesThatDifferByFarAreResolvedAsStated) {
  const EntityId ground = create(row_of(add(make_box({10'000.0, 10'000.0, 100.0})), {0.0, 0.0, -50.0}));
  const EntityId grain = create(row_of(add(make_box({0.001, 0.001, 0.001})), {1000.0, 2000.0, 0.01}));
  const ContactPair found = pair(grain, ground);
  EXPECT_EQ(found.status, PairStatus::separate);
  // Four units in the last place of half the ground's diagonal.
  EXPECT_NEAR(found.distance_m, 0.0095f, 0.002f);
}

/// Twelve cubes in a row, each touching its neighbours.
TEST_F(ContactTest, PairsOfMasksAreListedOnceAndInOrder) {
  std::vector<EntityId> cubes;
  for (int i = 0; i < 12; ++i) {
    EntityRow row = row_of(cube(), {0.99 * i, 0.0, 0.0});
    row.mask = i % 2 == 0 ? 1u : 2u;
    cubes.push_back(create(row));
  }
  const Answered all = search({});
  EXPECT_EQ(all.found, 11u);
  ASSERT_EQ(all.pairs.size(), 11u);
  for (std::size_t i = 0; i < all.pairs.size(); ++i) {
    EXPECT_EQ(all.pairs[i].first, cubes[i]);
    EXPECT_EQ(all.pairs[i].second, cubes[i + 1]);
    EXPECT_NEAR(all.pairs[i].distance_m, -0.01f, 1e-5f);
  }
  EXPECT_EQ(search({.first_mask = 1u, .second_mask = 2u}).found, 11u);
  EXPECT_EQ(search({.first_mask = 2u, .second_mask = 1u}).found, 11u);
  EXPECT_EQ(search({.first_mask = 1u, .second_mask = 1u}).found, 0u);
  const Answered of_one = search({.first = cubes[5]});
  ASSERT_EQ(of_one.pairs.size(), 2u);
  EXPECT_EQ(of_one.pairs[0].first, cubes[5]);
  EXPECT_EQ(of_one.pairs[0].second, cubes[4]);
  EXPECT_EQ(of_one.pairs[1].second, cubes[6]);
}

TEST_F(ContactTest, ExceededCapacitiesAreFlagged) {
  const EntityId hall = create(row_of(add(make_box({10.0, 10.0, 10.0}))));
  for (int i = 0; i < 40; ++i)
    cube_at({-4.0 + 0.2 * i, 0.1 * i, 0.0});
  const Answered whole = search({.first = hall});
  EXPECT_EQ(whole.pairs.size(), 40u);
  EXPECT_FALSE(whole.overflow);
  const Answered cut = search({.first = hall}, {.pairs_per_search = 7, .max_candidates = 64});
  EXPECT_EQ(cut.found, 40u);
  EXPECT_TRUE(cut.overflow);
  ASSERT_EQ(cut.pairs.size(), 7u);
  for (std::size_t i = 0; i < 7; ++i)
    EXPECT_EQ(cut.pairs[i].second, whole.pairs[i].second);
  const Answered few = search({.first = hall}, {.pairs_per_search = 64, .max_candidates = 39});
  EXPECT_TRUE(few.overflow);
  EXPECT_EQ(few.candidates, 40u);
  EXPECT_TRUE(few.pairs.empty());
  const Answered bodies = search({}, {.pairs_per_search = 4096, .max_bodies = 5});
  EXPECT_TRUE(bodies.overflow);
}

TEST_F(ContactTest, VelocityIsThatOfTheBodiesAtThePoint) {
  EntityRow wheel = row_of(cube(), {0.0, 0.0, 0.99});
  wheel.motion.v_world_mps = {1.0, 0.0, -2.0};
  wheel.motion.w_world_radps = {0.0, 3.0, 0.0};
  const EntityId first = create(wheel);
  EntityRow base = row_of(cube());
  base.motion.v_world_mps = {0.5, 0.0, 0.0};
  const EntityId second = create(base);
  const ContactPair found = pair(first, second);
  ASSERT_GT(found.point_count, 0u);
  for (const ContactPoint& point : found.contacts()) {
    const glm::dvec3 wanted =
        glm::dvec3(0.5, 0.0, -2.0) + glm::cross(glm::dvec3(0.0, 3.0, 0.0), glm::dvec3(point.p_first_m));
    expect_near(point.v_relative_mps, wanted, 1e-4);
  }
}

/// Bodies are at their places at the time of the search.
TEST_F(ContactTest, TimeOfTheSearch) {
  EntityRow moving = row_of(cube(), {-5.0, 0.0, 0.0});
  moving.motion.v_world_mps = {10.0, 0.0, 0.0};
  const EntityId first = create(moving);
  const EntityId second = cube_at({0.0, 0.0, 0.0});
  EXPECT_NEAR(pair(first, second).distance_m, 4.0f, 1e-4f);
  EXPECT_NEAR(pair(first, second, 0.0f, at_s(0.2)).distance_m, 2.0f, 1e-4f);
  EXPECT_NEAR(pair(first, second, 0.0f, at_s(0.45)).distance_m, -0.5f, 1e-4f);
}

/// Two cubes as one mesh, 3 m apart along x.
TriangleMesh two_cubes() {
  TriangleMesh mesh = make_box({1.0, 1.0, 1.0});
  const TriangleMesh other = mesh;
  const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
  for (const glm::vec3& p : other.positions_m)
    mesh.positions_m.push_back(p + glm::vec3(3.0f, 0.0f, 0.0f));
  for (const glm::uvec3& triangle : other.triangles)
    mesh.triangles.push_back(triangle + first);
  return mesh;
}

TEST_F(ContactTest, BodiesOfConvexParts) {
  const GeometryId geometry = add(two_cubes());
  EXPECT_FALSE(database().geometry_info(geometry)->convex);
  EXPECT_EQ(database().geometry_info(geometry)->convex_parts, 2u);
  const EntityId both = create(row_of(geometry));
  // Between the parts, and in the bounds of the whole.
  EXPECT_NEAR(pair(cube_at({1.5, 0.0, 0.0}), both).distance_m, 0.5f, 1e-5f);
  const EntityId deck = create(row_of(add(make_box({6.0, 3.0, 1.0})), {1.5, 0.0, 0.98}));
  const ContactPair on_both = pair(deck, both);
  EXPECT_EQ(on_both.status, PairStatus::contact);
  EXPECT_NEAR(on_both.distance_m, -0.02f, 1e-5f);
  expect_near(on_both.n_world, {0.0, 0.0, 1.0}, 1e-4);
  // The outer corners of both parts span the most area.
  ASSERT_EQ(on_both.point_count, 4u);
  double span_m = 0.0;
  for (const ContactPoint& point : on_both.contacts()) {
    expect_near(point.n_world, {0.0, 0.0, 1.0}, 1e-4);
    span_m =
        std::max(span_m, std::abs(static_cast<double>(point.p_first_m.x - on_both.points[0].p_first_m.x)));
  }
  EXPECT_NEAR(span_m, 4.0, 1e-3);
  // The triangles of the second cube follow those of the first one.
  const ContactPair right = pair(cube_at({3.0, 0.0, -0.99}), both);
  ASSERT_GT(right.point_count, 0u);
  EXPECT_GE(right.points[0].second_triangle, 12u);
}

TEST_F(ContactTest, SheetInACube) {
  const GeometryId sheet = add(make_rectangle(1.0, 1.0));
  EXPECT_EQ(database().geometry_info(sheet)->convex_parts, 0u);
  const EntityId first = create(row_of(sheet));
  const EntityId second = cube_at({0.0, 0.0, 0.4});
  const ContactPair found = pair(first, second);
  EXPECT_EQ(found.status, PairStatus::contact);
  EXPECT_TRUE(found.has_depth);
  EXPECT_NEAR(found.distance_m, -0.1f, 1e-6f);
  expect_near(found.n_world, {0.0, 0.0, -1.0}, 1e-5);
  ASSERT_GT(found.point_count, 0u);
  EXPECT_NEAR(found.points[0].p_first_m.z, -0.05f, 1e-6f);
}

TEST_F(ContactTest, SheetsThatCrossHaveNoDepth) {
  const GeometryId sheet = add(make_rectangle(1.0, 1.0));
  EntityRow upright = row_of(sheet, {0.1, 0.0, 0.0});
  upright.motion.q_world = glm::angleAxis(0.5 * std::numbers::pi, glm::dvec3(0.0, 1.0, 0.0));
  const EntityId first = create(row_of(sheet));
  const EntityId second = create(upright);
  const ContactPair found = pair(first, second);
  EXPECT_EQ(found.status, PairStatus::contact);
  EXPECT_FALSE(found.has_depth);
  EXPECT_EQ(found.distance_m, 0.0f);
  ASSERT_GT(found.point_count, 0u);
  EXPECT_NEAR(found.points[0].p_first_m.x, 0.1f, 1e-5f);
  EXPECT_NEAR(found.points[0].p_first_m.z, 0.0f, 1e-5f);
  // Apart there is a distance.
  const ContactPair apart = pair(first, create(row_of(sheet, {0.0, 0.0, 2.0})), 2.5f);
  EXPECT_EQ(apart.status, PairStatus::near);
  EXPECT_NEAR(apart.distance_m, 2.0f, 1e-5f);
}

TEST_F(ContactTest, BadInputIsRefused) {
  const EntityId first = cube_at({0.0, 0.0, 0.0});
  const EntityId bare = create(EntityRow{});
  const auto query = prepare(ContactQueryOptions{.name = "contacts", .capacity = 1});
  const auto refusal = [&](const ContactSearch& one) {
    query->searches()[0] = one;
    const Outcome outcome = run(*query, 1);
    EXPECT_FALSE(outcome.done());
    return outcome.bad_input;
  };
  EXPECT_EQ(refusal({.margin_m = -1.0f}).reason, BadInputReason::bad_contact);
  EXPECT_EQ(refusal({.margin_m = std::nanf("")}).field, "margin_m");
  EXPECT_EQ(refusal({.first = first, .second = first}).reason, BadInputReason::bad_contact);
  EXPECT_EQ(refusal({.second = first}).reason, BadInputReason::bad_contact);
  EXPECT_EQ(refusal({.first = bare}).reason, BadInputReason::no_geometry);
  EXPECT_EQ(refusal({.first = first, .second = EntityId{77, 1}}).reason, BadInputReason::unknown_entity);
  const auto code_of = [&](ContactQueryOptions options) {
    options.name = "refused";
    const auto made = database().prepare(options);
    return made ? std::string("made") : made.error().message;
  };
  EXPECT_NE(code_of({.capacity = 0}).find("0 searches; 1 to 65536"), std::string::npos);
  EXPECT_NE(code_of({.capacity = 1, .pairs_per_search = 0}).find("pairs per search"), std::string::npos);
  EXPECT_NE(code_of({.capacity = 1, .max_candidates = 2'000'000}).find("2000000 candidates"),
            std::string::npos);
  EXPECT_NE(code_of({.capacity = 1, .max_bodies = 0}).find("bodies"), std::string::npos);
}

}  // namespace
}  // namespace rtstdb::test
