// Contacts and impacts of solids (GeometryOptions::solid) against closed forms, and against fine meshes.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/expect_vector.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

class SolidContacts : public DatabaseTest {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    open({.max_entities = 8192});
  }
  GeometryId solid(const TriangleMesh& mesh, const Solid& solid) {
    GeometryOptions options;
    options.solid = solid;
    const auto added = database().add_geometry(mesh, "solid" + std::to_string(count_++), options);
    EXPECT_TRUE(added.ok()) << (added.ok() ? "" : added.error().message);
    return added.ok() ? added.value() : GeometryId{};
  }
  GeometryId sphere(double radius_m) {
    return solid(make_sphere(radius_m), {.kind = SolidKind::sphere, .radius_m = radius_m});
  }
  GeometryId cylinder(double radius_m, double height_m) {
    return solid(make_cylinder(radius_m, height_m),
                 {.kind = SolidKind::cylinder, .radius_m = radius_m, .height_m = height_m});
  }
  GeometryId capsule(double radius_m, double height_m) {
    return solid(capsule_mesh(radius_m, height_m, 2),
                 {.kind = SolidKind::capsule, .radius_m = radius_m, .height_m = height_m});
  }
  static TriangleMesh capsule_mesh(double radius_m, double height_m, std::uint32_t subdivisions) {
    std::vector<glm::vec3> points_m;
    for (const glm::vec3& p_m : make_sphere(radius_m, subdivisions).positions_m)
      for (const double side : {-0.5, 0.5})
        points_m.push_back(p_m + glm::vec3(0.0f, 0.0f, static_cast<float>(side * height_m)));
    return make_hull(points_m).value();
  }
  EntityId placed(GeometryId geometry, const glm::dvec3& p_m, const glm::dquat& q = {1.0, 0.0, 0.0, 0.0}) {
    EntityRow row = row_of(geometry, p_m);
    row.motion.q_world = q;
    return create(row);
  }
  std::vector<ContactPair> pairs(const std::vector<std::pair<EntityId, EntityId>>& bodies,
                                 float margin_m = 0.0f) {
    const auto count = static_cast<std::uint32_t>(bodies.size());
    const auto query = prepare(
        ContactQueryOptions{.name = "contacts", .capacity = count, .pairs_per_search = 1, .max_bodies = 1});
    if (!query) return {};
    for (std::size_t i = 0; i < bodies.size(); ++i)
      query->searches()[i] = {.first = bodies[i].first, .second = bodies[i].second, .margin_m = margin_m};
    const Outcome outcome = run(*query, bodies.size());
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    std::vector<ContactPair> found;
    for (const ContactAnswer& answer : query->answers()) {
      EXPECT_EQ(answer.pairs.size(), 1u);
      found.push_back(answer.pairs.empty() ? ContactPair{} : answer.pairs[0]);
    }
    return found;
  }
  ContactPair pair(EntityId first, EntityId second, float margin_m = 0.0f) {
    const auto found = pairs({{first, second}}, margin_m);
    return found.empty() ? ContactPair{} : found[0];
  }

 private:
  std::size_t count_ = 0;
};

const glm::dquat lying = glm::angleAxis(0.5 * std::numbers::pi, glm::dvec3(0.0, 1.0, 0.0));

TEST_F(SolidContacts, SpheresAreRound) {
  const GeometryId small = sphere(0.3);
  const GeometryId large = sphere(1.0);
  Random random(60);
  std::vector<std::pair<EntityId, EntityId>> bodies;
  std::vector<glm::dvec3> offs_m;
  for (int i = 0; i < 500; ++i) {
    const glm::dvec3 p_m(10.0 * i, 0.0, 0.0);
    offs_m.push_back(random.uniform(0.8, 1.6) * random.direction());
    bodies.emplace_back(placed(large, p_m, random.orientation()),
                        placed(small, p_m + offs_m.back(), random.orientation()));
  }
  const std::vector<ContactPair> found = pairs(bodies, 0.05f);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double distance_m = glm::length(offs_m[i]) - 1.3;
    SCOPED_TRACE(testing::Message() << "pair " << i << ", " << distance_m << " m");
    const double allowed_m = 6e-5 + 0.01 * std::max(-distance_m, 0.0);
    EXPECT_NEAR(found[i].distance_m, distance_m, allowed_m);
    const glm::dvec3 n = -glm::normalize(offs_m[i]);
    if (distance_m > 0.05) {
      EXPECT_EQ(found[i].status, PairStatus::separate);
    } else if (std::abs(distance_m) > 1e-4) {
      EXPECT_EQ(found[i].status, distance_m < 0.0 ? PairStatus::contact : PairStatus::near);
      ASSERT_EQ(found[i].point_count, 1u);
      expect_near(found[i].points[0].n_world, n, 0.0175);
      expect_near(found[i].points[0].p_first_m, -n * (1.0 + 0.5 * distance_m), 0.02);
    }
  }
}

/// The mesh of the sphere has no corner at the lowest point, which a turned sphere has anyway.
TEST_F(SolidContacts, SphereOnABoxTouchesInOnePoint) {
  const EntityId floor = placed(add(make_box({10.0, 10.0, 1.0})), {0.0, 0.0, -0.5});
  const GeometryId ball = sphere(0.5);
  Random random(61);
  for (int i = 0; i < 20; ++i) {
    const glm::dvec3 p_m(0.1 * i, 0.0, 0.499);
    const ContactPair found = pair(placed(ball, p_m, random.orientation()), floor);
    EXPECT_EQ(found.status, PairStatus::contact);
    EXPECT_NEAR(found.distance_m, -1e-3f, 2e-5f);
    ASSERT_EQ(found.point_count, 1u);
    expect_near(found.points[0].n_world, {0.0, 0.0, 1.0}, 2e-3);
    expect_near(found.points[0].p_first_m, {0.0, 0.0, -0.4995}, 2e-3);
  }
}

/// The search must not conclude from a simplex that all but contains the origin that the bodies are apart.
TEST_F(SolidContacts, SphereOnALargeBoxIsAsDeepAsItLies) {
  const EntityId floor = placed(add(make_box({100.0, 10.0, 1.0})), {0.0, 0.0, -0.5});
  const std::vector<GeometryId> balls{sphere(0.1), add(make_sphere(0.1))};
  Random random(63);
  std::vector<std::pair<EntityId, EntityId>> bodies;
  std::vector<double> depths_m;
  for (int i = 0; i < 4000; ++i) {
    const glm::dvec3 aside = random.magnitude(1e-10, 1.0) * random.vector();
    // The mesh has facets, and stands on a corner without a rotation.
    const glm::dquat q = i % 2 == 0 ? random.orientation() : glm::dquat(1.0, 0.0, 0.0, 0.0);
    depths_m.push_back(random.uniform(-0.02, 0.03));
    bodies.emplace_back(floor, placed(balls[i % 2], {aside.x, aside.y, 0.1 - depths_m.back()}, q));
  }
  const std::vector<ContactPair> found = pairs(bodies, 0.05f);
  std::size_t undecided = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    SCOPED_TRACE(testing::Message() << "pair " << i << ", depth " << depths_m[i] << " m, bounds "
                                    << found[i].min_distance_m << " to " << found[i].max_distance_m << " m");
    const double allowed_m = 1e-4 + 0.01 * std::abs(depths_m[i]);
    EXPECT_LE(found[i].min_distance_m, -depths_m[i] + allowed_m);
    EXPECT_GE(found[i].max_distance_m, -depths_m[i] - allowed_m);
    if (found[i].status == PairStatus::undecided) {
      ++undecided;
    } else {
      EXPECT_NEAR(found[i].distance_m, -depths_m[i], allowed_m);
    }
  }
  EXPECT_LE(undecided, found.size() / 20);
}

TEST_F(SolidContacts, CylinderAndCapsuleThatLieOnABoxTouchAtTheirEnds) {
  const EntityId floor = placed(add(make_box({10.0, 10.0, 1.0})), {0.0, 0.0, -0.5});
  for (const GeometryId body : {cylinder(0.5, 2.0), capsule(0.5, 2.0)}) {
    for (const double roll : {0.0, 0.05, 1.0}) {
      const glm::dquat q = lying * glm::angleAxis(roll, glm::dvec3(0.0, 0.0, 1.0));
      const ContactPair found = pair(placed(body, {0.3, 0.2, 0.499}, q), floor, 0.01f);
      EXPECT_EQ(found.status, PairStatus::contact);
      EXPECT_NEAR(found.distance_m, -1e-3f, 2e-5f);
      ASSERT_EQ(found.point_count, 2u);
      for (const ContactPoint& point : found.contacts()) {
        EXPECT_NEAR(point.depth_m, 1e-3f, 2e-5f);
        EXPECT_NEAR(std::abs(point.p_first_m.x), 1.0f, 1e-3f);
        EXPECT_NEAR(point.p_first_m.y, 0.0f, 2e-3f);
      }
    }
  }
}

TEST_F(SolidContacts, CylinderThatStandsTouchesAtItsRim) {
  const EntityId floor = placed(add(make_box({10.0, 10.0, 1.0})), {0.0, 0.0, -0.5});
  const ContactPair found = pair(placed(cylinder(0.5, 2.0), {0.3, 0.2, 0.999}), floor);
  EXPECT_NEAR(found.distance_m, -1e-3f, 2e-5f);
  ASSERT_EQ(found.point_count, 4u);
  for (const ContactPoint& point : found.contacts()) {
    EXPECT_NEAR(point.depth_m, 1e-3f, 2e-5f);
    EXPECT_NEAR(glm::length(glm::vec2(point.p_first_m)), 0.5f, 1e-3f);
  }
}

TEST_F(SolidContacts, ParallelCapsulesTouchAlongTheCommonPartAndCrossedOnesInAPoint) {
  const GeometryId body = capsule(0.5, 2.0);
  const EntityId lower = placed(body, {0.0, 0.0, 0.0}, lying);
  const ContactPair along = pair(placed(body, {0.8, 0.0, 0.999}, lying), lower);
  EXPECT_NEAR(along.distance_m, -1e-3f, 2e-5f);
  ASSERT_EQ(along.point_count, 2u);
  EXPECT_NEAR(std::abs(along.points[0].p_first_m.x - along.points[1].p_first_m.x), 1.2f, 2e-3f);
  const glm::dquat across = glm::angleAxis(0.5 * std::numbers::pi, glm::dvec3(1.0, 0.0, 0.0));
  const ContactPair crossed = pair(placed(body, {0.4, 0.3, 0.999}, across), lower);
  EXPECT_NEAR(crossed.distance_m, -1e-3f, 2e-5f);
  ASSERT_EQ(crossed.point_count, 1u);
  expect_near(crossed.points[0].p_first_m, {0.0, -0.3, -0.4995}, 2e-2);
}

/// Solids with any scale, against hulls of so many corners that they deviate by less than the tolerance.
TEST_F(SolidContacts, RandomPairsAgreeWithFineMeshes) {
  struct Shape {
    GeometryId solid, fine;
  };
  const std::vector<Shape> shapes{
      {sphere(0.5), add(make_sphere(0.5, 5))},
      {cylinder(0.4, 0.9), add(make_cylinder(0.4, 0.9, 512))},
      {capsule(0.3, 0.8), add(capsule_mesh(0.3, 0.8, 4))},
      {solid(make_box({0.7, 0.5, 0.9}), {.kind = SolidKind::box, .size_m = {0.7, 0.5, 0.9}}),
       add(make_box({0.7, 0.5, 0.9}))},
  };
  Random random(62);
  std::vector<std::pair<EntityId, EntityId>> of_solids, of_meshes;
  for (int i = 0; i < 500; ++i) {
    const Shape& first = shapes[random.below(shapes.size())];
    const Shape& second = shapes[random.below(shapes.size())];
    const glm::dvec3 p_m(10.0 * i, 0.0, 0.0);
    EntityRow a = row_of(first.solid, p_m);
    EntityRow b = row_of(second.solid, p_m + random.uniform(0.2, 1.6) * random.direction());
    for (EntityRow* row : {&a, &b}) {
      row->motion.q_world = random.orientation();
      row->scale = random.one_in(2) ? glm::dvec3(random.uniform(0.7, 1.4), random.uniform(0.7, 1.4),
                                                 random.uniform(0.7, 1.4))
                                    : glm::dvec3(1.0);
    }
    of_solids.emplace_back(create(a), create(b));
    a.geometry = first.fine;
    b.geometry = second.fine;
    a.mask = b.mask = 2;
    of_meshes.emplace_back(create(a), create(b));
  }
  const std::vector<ContactPair> solids = pairs(of_solids);
  const std::vector<ContactPair> meshes = pairs(of_meshes);
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    SCOPED_TRACE(testing::Message() << "pair " << i << ", " << meshes[i].distance_m << " m");
    ASSERT_NE(solids[i].status, PairStatus::undecided);
    const double depth_m = std::max(-meshes[i].distance_m, 0.0f);
    // Each depth may be off by 1 %.
    EXPECT_NEAR(solids[i].distance_m, meshes[i].distance_m, 1.5e-3 + 0.02 * depth_m);
    contacts += solids[i].status == PairStatus::contact ? 1 : 0;
    if (solids[i].status == PairStatus::contact) {
      EXPECT_GE(solids[i].point_count, 1u);
    }
  }
  EXPECT_GT(contacts, 100u);
  EXPECT_LT(contacts, 400u);
}

TEST_F(SolidContacts, TimeOfImpactIsThatOfTheRoundBody) {
  const EntityId floor = placed(add(make_box({10.0, 10.0, 1.0})), {0.0, 0.0, -0.5});
  EntityRow ball = row_of(sphere(0.5), {0.0, 0.0, 3.5});
  ball.motion.v_world_mps = {0.0, 0.0, -2.0};
  ball.motion.w_world_radps = {3.0, 1.0, 2.0};
  const EntityId falling = create(ball);
  const auto query = prepare(ImpactQueryOptions{.name = "impacts", .capacity = 1});
  ASSERT_NE(query, nullptr);
  query->searches()[0] = {
      .first = falling, .second = floor, .window = Nanoseconds(5'000'000'000), .tolerance_m = 1e-4f};
  ASSERT_TRUE(run(*query, 1).done());
  const ImpactAnswer& answer = query->answers()[0];
  EXPECT_EQ(answer.status, ImpactStatus::impact);
  EXPECT_NEAR(static_cast<double>(answer.after.count()) * 1e-9, 1.5, 1e-4);
}

/// The search by masks finds a body by the bounds of the solid, not by those of its mesh.
TEST_F(SolidContacts, IsFoundWhereTheSolidReachesBeyondTheMesh) {
  TriangleMesh coarse = make_cylinder(1.0, 1.0, 16);
  const EntityId drum = placed(
      solid(coarse, {.kind = SolidKind::cylinder, .radius_m = 1.01, .height_m = 1.0}), {0.0, 0.0, 0.0});
  placed(add(make_box({1.0, 1.0, 1.0})), {1.505, 0.0, 0.0});
  const auto query = prepare(ContactQueryOptions{.name = "contacts", .capacity = 1});
  ASSERT_NE(query, nullptr);
  query->searches()[0] = {.first = drum};
  ASSERT_TRUE(run(*query, 1).done());
  ASSERT_EQ(query->answers()[0].pairs.size(), 1u);
  EXPECT_NEAR(query->answers()[0].pairs[0].distance_m, -0.005f, 1e-4f);
}

TEST_F(SolidContacts, AreReportedByTheGeometryAndRefusedWithValues) {
  EXPECT_TRUE(database().geometry_info(sphere(0.5))->solid);
  EXPECT_FALSE(database().geometry_info(add(make_sphere(0.5)))->solid);
  const auto refused = [&](const GeometryOptions& options) {
    const auto added = database().add_geometry(make_sphere(0.5), "refused", options);
    return added.ok() ? std::string("added") : added.error().message;
  };
  GeometryOptions options;
  options.solid = Solid{.kind = SolidKind::sphere, .radius_m = 0.7};
  EXPECT_NE(refused(options).find("the sphere is 0.2 m off the mesh"), std::string::npos) << refused(options);
  options.solid->radius_m = 0.5;
  options.deforms = true;
  EXPECT_NE(refused(options).find("deforms can not be a solid"), std::string::npos) << refused(options);
  options.deforms = false;
  options.convex_parts_m = {make_box({1.0, 1.0, 1.0}).positions_m};
  EXPECT_NE(refused(options).find("can not have convex parts"), std::string::npos) << refused(options);
}

}  // namespace
}  // namespace rtstdb::test
