// The fractions of a beam in both modes, against closed forms, with hidden and with small entities.

#include <cmath>
#include <numbers>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

constexpr double pi = std::numbers::pi;

/// A disc of `segments` triangles about the z axis, with a hole of that radius (0: none).
TriangleMesh disc(double radius_m, double hole_m, std::uint32_t segments) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < segments; ++i) {
    const double a = 2.0 * pi * i / segments;
    const double b = 2.0 * pi * (i + 1) / segments;
    const auto at = [&](double r, double angle) {
      return glm::vec3(r * std::cos(angle), r * std::sin(angle), 0.0);
    };
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    if (hole_m > 0.0) {
      mesh.positions_m.insert(mesh.positions_m.end(),
                              {at(hole_m, a), at(radius_m, a), at(radius_m, b), at(hole_m, b)});
      mesh.triangles.emplace_back(first, first + 1, first + 2);
      mesh.triangles.emplace_back(first, first + 2, first + 3);
    } else {
      mesh.positions_m.insert(mesh.positions_m.end(), {glm::vec3(0.0f), at(radius_m, a), at(radius_m, b)});
      mesh.triangles.emplace_back(first, first + 1, first + 2);
    }
  }
  return mesh;
}

class ConeFractions : public DatabaseTest, public testing::WithParamInterface<ConeMode> {
 protected:
  static constexpr std::uint32_t per_cone = 8;
  /// The permitted error of a fraction: that of the exact mode, or what 64 directions resolve.
  static double within(double exact) {
    return GetParam() == ConeMode::exact ? exact : std::max(exact, 2.0 / 64.0);
  }
  /// A beam from the origin along -z, of that radius at a distance of one metre.
  static Cone beam(double radius) {
    Cone cone;
    cone.direction = {0.0f, 0.0f, -1.0f};
    cone.opening_angle_rad = static_cast<float>(2.0 * std::atan(radius));
    return cone;
  }
  std::vector<ConeReturn> returns_of(const Cone& cone, Faces faces = Faces::both) {
    auto query = database().prepare(ConeQueryOptions{.name = "beam",
                                                     .capacity = 1,
                                                     .returns_per_cone = per_cone,
                                                     .faces = faces,
                                                     .mode = GetParam(),
                                                     .fractions = true});
    if (!query) {
      ADD_FAILURE() << query.error().message;
      return {};
    }
    query.value()->cones()[0] = cone;
    const Outcome outcome =
        execute([&](Transaction& transaction) { transaction.add_query(*query.value(), 1); });
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    truncated_ = outcome.status == Status::truncated;
    std::vector<ConeReturn> hits;
    double sum = 0.0;
    for (const ConeReturn& one : query.value()->returns()) {
      EXPECT_NE(one.status, HitStatus::incomplete);
      if (one.status != HitStatus::hit) continue;
      EXPECT_GT(one.fraction, 0.0f);
      hits.push_back(one);
      sum += static_cast<double>(one.fraction);
    }
    EXPECT_LE(sum, 1.0 + 1e-6);
    return hits;
  }
  double only_fraction(const Cone& cone, Faces faces = Faces::both) {
    const auto hits = returns_of(cone, faces);
    EXPECT_EQ(hits.size(), 1u);
    return hits.empty() ? 0.0 : static_cast<double>(hits[0].fraction);
  }
  bool truncated_ = false;
};

TEST_P(ConeFractions, APlateOverTheWholeBeamOrAPartOfIt) {
  const EntityId plate = create(row_of(add(make_rectangle(20.0, 20.0)), {0.0, 0.0, -10.0}));
  EXPECT_NEAR(only_fraction(beam(0.1)), 1.0, within(1e-5));
  EntityRow row = row_of({0}, {10.0, 0.0, -10.0});
  for (const double turn_rad : {0.0, 0.3, 1.1, 2.5}) {
    row.motion.p_world_m = {10.0 * std::cos(turn_rad), 10.0 * std::sin(turn_rad), -10.0};
    row.motion.q_world = glm::angleAxis(turn_rad, glm::dvec3(0.0, 0.0, 1.0));
    update_motion(plate, row.motion, {});
    EXPECT_NEAR(only_fraction(beam(0.1)), 0.5, within(1e-4)) << turn_rad;
    // Its border is half a radius beyond the axis: it leaves a segment of the disc free.
    row.motion.p_world_m *= 1.05;
    row.motion.p_world_m.z = -10.0;
    update_motion(plate, row.motion, {});
    const double segment = (std::acos(0.5) - 0.5 * std::sqrt(0.75)) / pi;
    EXPECT_NEAR(only_fraction(beam(0.1)), segment, within(1e-4)) << turn_rad;
  }
}

/// A plate that reaches beside and behind the apex, and a beam that ends on it.
TEST_P(ConeFractions, APlateUnderTheBeam) {
  EntityRow row = row_of(add(make_rectangle(2000.0, 2000.0)), {0.0, -1.0, 0.0});
  row.motion.q_world = glm::angleAxis(-0.5 * pi, glm::dvec3(1.0, 0.0, 0.0));
  create(row);
  // All directions below the horizon meet its plane, half of the beam, some of them beyond its border.
  EXPECT_NEAR(only_fraction(beam(0.5)), 0.5, within(2e-3));
  EXPECT_NEAR(only_fraction(beam(5.0)), 0.5, within(2e-3));
  // Up to 10 m only the directions steeper than one in ten meet it.
  Cone cone = beam(0.5);
  cone.lambda_max = 10.0f;
  const double segment = (std::acos(0.2) - 0.2 * std::sqrt(1.0 - 0.04)) / pi;
  EXPECT_NEAR(only_fraction(cone), segment, within(1e-3));
}

/// A tilted plate with its corners in the cone, and a beam that ends in the middle of it.
TEST_P(ConeFractions, APlateInWhichTheBeamEnds) {
  const double tilt_rad = pi / 3.0;
  EntityRow row = row_of(add(make_rectangle(0.2, 1.0)), {0.0, 0.0, -10.0});
  row.motion.q_world = glm::angleAxis(tilt_rad, glm::dvec3(1.0, 0.0, 0.0));
  create(row);
  // The half-plate nearer than 10 m, projected to a distance of one metre, is a trapezoid.
  const double near_m = 10.0 - 0.5 * std::sin(tilt_rad);
  const double trapezoid = 0.5 * (0.2 / 10.0 + 0.2 / near_m) * 0.5 * std::cos(tilt_rad) / near_m;
  Cone cone = beam(0.1);
  cone.lambda_max = 10.0f;
  const double wanted = trapezoid / (pi * 0.01);
  EXPECT_NEAR(only_fraction(cone), wanted, 1e-3 * wanted);
}

TEST_P(ConeFractions, AHoleSmallerThanTheBeam) {
  create(row_of(add(disc(5.0, 0.3, 64)), {0.0, 0.0, -10.0}));
  const double hole = 0.3 * 0.3 * 64.0 / (2.0 * pi) * std::sin(2.0 * pi / 64.0);
  EXPECT_NEAR(only_fraction(beam(0.1)), 1.0 - hole, within(1e-4));
}

/// The disc is smaller than the pattern of directions resolves.
TEST_P(ConeFractions, ADiscOfACentimetreAtFiveHundredMetres) {
  const EntityId target = create(row_of(add(disc(0.005, 0.0, 24)), {0.0, 0.0, -500.0}));
  const double radius_m = 500.0 * std::tan(0.0001745);
  for (const double beside : {0.0, 0.3, 0.7}) {
    Motion motion;
    motion.p_world_m = {beside * radius_m, 0.2 * beside * radius_m, -500.0};
    update_motion(target, motion, {});
    Cone cone = beam(std::tan(0.0001745));
    EXPECT_NEAR(only_fraction(cone), std::pow(0.005 / radius_m, 2.0), 0.1 * std::pow(0.005 / radius_m, 2.0));
  }
}

/// However many triangles it has, and whether its fronts or its backs count or both.
TEST_P(ConeFractions, ASmallSphereOfManyTriangles) {
  const EntityId sphere = create(row_of(add(make_sphere(0.001, 4)), {0.0, 0.0, -10.0}));
  for (const double beside_m : {0.0, 0.02, 0.06}) {
    Motion motion;
    motion.p_world_m = {beside_m, 0.5 * beside_m, -10.0};
    update_motion(sphere, motion, {});
    const double wanted = std::pow(0.001 / 0.08727, 2.0);
    for (const Faces faces : {Faces::both, Faces::front, Faces::back}) {
      EXPECT_NEAR(only_fraction(beam(0.008727), faces), wanted, 0.02 * wanted)
          << beside_m << ", " << to_string(faces);
    }
  }
}

/// A body that only touches the beam gets next to nothing of it.
TEST_P(ConeFractions, APlateThatTouchesTheBeam) {
  const EntityId plate = create(row_of(add(make_rectangle(20.0, 20.0)), {}));
  for (const double turn_rad : {0.0, 0.3, 1.1, 2.5}) {
    for (const double gap : {-1e-6, 0.0, 1e-6}) {
      Motion motion;
      const double from_m = 10.0 + 1.0 + gap;
      motion.p_world_m = {from_m * std::cos(turn_rad), from_m * std::sin(turn_rad), -10.0};
      motion.q_world = glm::angleAxis(turn_rad, glm::dvec3(0.0, 0.0, 1.0));
      update_motion(plate, motion, {});
      for (const ConeReturn& one : returns_of(beam(0.1)))
        EXPECT_LT(one.fraction, 1e-4f) << turn_rad << ", " << gap;
    }
  }
}

/// A side of it lies in a plane through the apex, which the beam touches.
TEST_P(ConeFractions, ABoxWithASideAlongTheBorderOfTheBeam) {
  constexpr double half_rad = 0.5 * pi / 180.0;
  create(row_of(add(make_box({10.0, 10.0, 0.01})), {5.0, 0.0, -10.005}));
  Cone cone;
  cone.opening_angle_rad = static_cast<float>(2.0 * half_rad);
  for (const double beside_rad : {0.0, 1e-7, -1e-7, 3e-7, -3e-7}) {
    const double turn_rad = half_rad + beside_rad;
    cone.direction = glm::vec3(glm::dvec3(-std::sin(turn_rad), 0.0, -std::cos(turn_rad)));
    for (const ConeReturn& one : returns_of(cone))
      EXPECT_LT(one.fraction, 1e-4f) << beside_rad;
  }
}

TEST_P(ConeFractions, OneBehindAnother) {
  const GeometryId plate = add(make_rectangle(20.0, 20.0));
  const EntityId front = create(row_of(plate, {10.0, 0.0, -10.0}));
  const EntityId behind = create(row_of(plate, {0.0, 0.0, -20.0}));
  const EntityId hidden = create(row_of(plate, {10.0, 0.0, -30.0}));
  const auto hits = returns_of(beam(0.1));
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_EQ(hits[0].entity, front);
  EXPECT_EQ(hits[1].entity, behind);
  EXPECT_NEAR(static_cast<double>(hits[0].fraction), 0.5, within(1e-4));
  EXPECT_NEAR(static_cast<double>(hits[1].fraction), 0.5, within(1.0 / 64.0));
  EXPECT_TRUE(std::ranges::none_of(hits, [&](const ConeReturn& one) { return one.entity == hidden; }));
}

/// A small target before a wall keeps its fraction; behind the wall it has none.
TEST_P(ConeFractions, ASmallTargetBeforeAWallAndBehindIt) {
  create(row_of(add(make_rectangle(20.0, 20.0)), {0.0, 0.0, -20.0}));
  const EntityId target = create(row_of(add(disc(0.02, 0.0, 24)), {0.31, 0.0, -19.0}));
  const double wanted = std::pow(0.02 / 1.9, 2.0);
  auto hits = returns_of(beam(0.1));
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_EQ(hits[0].entity, target);
  EXPECT_NEAR(hits[0].fraction, wanted, 0.05 * wanted);
  EXPECT_GT(hits[1].fraction, 0.98f);
  Motion motion;
  motion.p_world_m = {0.31, 0.0, -21.0};
  update_motion(target, motion, {});
  hits = returns_of(beam(0.1));
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_NE(hits[0].entity, target);
}

/// A closed body covers the area of its outline, also if only its fronts or its backs count.
TEST_P(ConeFractions, AClosedBody) {
  create(row_of(add(make_sphere(0.5, 5)), {0.0, 0.0, -10.0}));
  const double sine = 0.05;
  const double outline = sine * sine / (1.0 - sine * sine);
  for (const Faces faces : {Faces::both, Faces::front, Faces::back})
    EXPECT_NEAR(only_fraction(beam(0.1), faces), outline / 0.01, within(4e-3)) << to_string(faces);
  Cone inside = beam(0.1);
  inside.origin_m = {0.0f, 0.0f, -10.0f};
  EXPECT_NEAR(only_fraction(inside), 1.0, within(1e-4));
}

TEST_P(ConeFractions, ARayHasAllOfItself) {
  const GeometryId plate = add(make_rectangle(20.0, 20.0));
  const EntityId front = create(row_of(plate, {0.0, 0.0, -10.0}));
  create(row_of(plate, {0.0, 0.0, -20.0}));
  for (const double radius : {0.0, 1e-9}) {
    const auto hits = returns_of(beam(radius));
    ASSERT_EQ(hits.size(), 1u);
    EXPECT_EQ(hits[0].entity, front);
    EXPECT_EQ(hits[0].fraction, 1.0f);
  }
}

/// More entities than a beam is distributed among: flagged if a part of the beam passes those.
TEST_P(ConeFractions, MoreEntitiesThanAreSearched) {
  const GeometryId chip = add(make_rectangle(0.1, 0.1));
  for (int i = 0; i < 20; ++i) {
    const int column = i % 5, line = i / 5;
    create(row_of(chip, {0.2 * column - 0.4, 0.2 * line - 0.3, -10.0 - 0.1 * i}));
  }
  auto hits = returns_of(beam(0.1));
  EXPECT_EQ(hits.size(), per_cone);
  EXPECT_TRUE(truncated_);
  for (const ConeReturn& one : hits)
    EXPECT_TRUE(one.overflow);
  // A plate before all of them leaves nothing open.
  create(row_of(add(make_rectangle(20.0, 20.0)), {0.0, 0.0, -5.0}));
  hits = returns_of(beam(0.1));
  EXPECT_EQ(hits.size(), 1u);
  EXPECT_FALSE(truncated_);
  EXPECT_FALSE(hits[0].overflow);
}

/// More triangles in the beam than a search may visit: the exact mode is incomplete. The fast mode visits few
/// of them.
TEST_P(ConeFractions, MoreTrianglesThanTheExactModeCanSearch) {
  create(row_of(add(make_sphere(1.0, 7)), {0.0, 0.0, -10.0}));
  const ConeQueryOptions options{
      .name = "beam", .capacity = 2, .returns_per_cone = 2, .mode = GetParam(), .fractions = true};
  auto query = database().prepare(options);
  ASSERT_TRUE(query.ok());
  query.value()->cones()[0] = beam(0.2);
  query.value()->cones()[1] = beam(0.002);
  Outcome outcome = execute([&](Transaction& transaction) { transaction.add_query(*query.value(), 2); });
  const auto returns = query.value()->returns();
  EXPECT_EQ(returns[2].status, HitStatus::hit);
  EXPECT_NEAR(returns[2].fraction, 1.0f, 1e-4f);
  EXPECT_EQ(returns[3].status, HitStatus::miss);
  if (GetParam() == ConeMode::fast) {
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    EXPECT_EQ(returns[0].status, HitStatus::hit);
    const double sine = 0.1;
    EXPECT_NEAR(static_cast<double>(returns[0].fraction), sine * sine / (1.0 - sine * sine) / 0.04,
                within(0.0));
    EXPECT_EQ(returns[1].status, HitStatus::miss);
    return;
  }
  EXPECT_EQ(outcome.status, Status::truncated) << describe(outcome);
  EXPECT_EQ(query.value()->answer_info().missing, 1u);
  EXPECT_EQ(returns[0].status, HitStatus::incomplete);
  EXPECT_EQ(returns[1].status, HitStatus::incomplete);
  EXPECT_EQ(returns[0].fraction, 0.0f);
  // The first contact needs few of them.
  auto first = database().prepare(ConeQueryOptions{.name = "first", .capacity = 1});
  ASSERT_TRUE(first.ok());
  first.value()->cones()[0] = beam(0.2);
  outcome = execute([&](Transaction& transaction) { transaction.add_query(*first.value(), 1); });
  EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
  EXPECT_NEAR(first.value()->returns()[0].lambda, 9.0f, 1e-3f);
}

/// The fractions of random beams, compared with dense samples.
TEST_P(ConeFractions, AreNearThoseOfDenseSamples) {
  Random random(41);
  const GeometryId sphere = add(make_sphere(0.5, 2));
  const GeometryId box = add(make_box({0.6, 0.8, 1.0}));
  for (int i = 0; i < 15; ++i) {
    EntityRow row = row_of(i % 2 == 0 ? sphere : box, glm::dvec3(0.0, 0.0, -20.0) + 1.5 * random.vector());
    row.motion.q_world = random.orientation();
    create(row);
  }
  constexpr std::uint32_t count = 24;
  const ConeQueryOptions options{.name = "beams",
                                 .capacity = count,
                                 .returns_per_cone = per_cone,
                                 .mode = GetParam(),
                                 .fractions = true};
  auto query = database().prepare(options);
  ASSERT_TRUE(query.ok());
  for (Cone& cone : query.value()->cones()) {
    cone = beam(random.magnitude(0.01, 0.1));
    cone.direction += glm::vec3(0.05 * random.vector());
  }
  ASSERT_TRUE(
      execute([&](Transaction& transaction) { transaction.add_query(*query.value(), count); }).done());
  const oracle::World everything = world();
  double square = 0.0;
  std::size_t compared = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto dense = oracle::beam_fractions(everything, query.value()->cones()[i], Faces::both, 65'536);
    for (const ConeReturn& one : query.value()->returns().subspan(std::size_t{i} * per_cone, per_cone)) {
      if (one.status != HitStatus::hit) continue;
      const auto found = std::ranges::find(dense, one.entity, &oracle::BeamFraction::entity);
      const double wanted = found == dense.end() ? 0.0 : found->fraction;
      EXPECT_NEAR(static_cast<double>(one.fraction), wanted, oracle::fraction_tolerance) << "beam " << i;
      square += std::pow(static_cast<double>(one.fraction) - wanted, 2.0);
      ++compared;
    }
  }
  EXPECT_GT(compared, 40u);
  const double deviation = std::sqrt(square / static_cast<double>(compared));
  RecordProperty("deviation", std::to_string(deviation));
  EXPECT_LT(deviation, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Modes, ConeFractions, testing::Values(ConeMode::exact, ConeMode::fast),
                         [](const auto& one) { return to_string(one.param); });

}  // namespace
}  // namespace rtstdb::test
