// Cones by distance fields: closed forms, and random worlds against the exact mode.

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/field_meshes.hpp"

namespace rtstdb::test {
namespace {

const ConeQueryOptions fast_options{.mode = ConeMode::fast};

class FastCones : public DatabaseTest {
 protected:
  GeometryId add_with_field(const TriangleMesh& mesh, const FieldOptions& options = {}) {
    const auto added = database().add_geometry(mesh, "mesh", {.field = options});
    if (!added) {
      ADD_FAILURE() << added.error().message;
      return {};
    }
    return added.value();
  }

  std::vector<ConeReturn> trace_cones(std::span<const Cone> cones, ConeQueryOptions options) {
    options.name = "cones";
    options.capacity = static_cast<std::uint32_t>(cones.size());
    auto query = prepare(options);
    if (query == nullptr) return {};
    std::ranges::copy(cones, query->cones().begin());
    const Outcome outcome = run(*query, cones.size());
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    return {query->returns().begin(), query->returns().end()};
  }
  ConeReturn trace_cone(const Cone& cone, const ConeQueryOptions& options = fast_options) {
    return trace_cones(std::span(&cone, 1), options).front();
  }
};

Cone cone_from(const glm::vec3& origin_m, const glm::vec3& direction, double opening_angle_rad) {
  Cone cone;
  cone.origin_m = origin_m;
  cone.direction = direction;
  cone.opening_angle_rad = static_cast<float>(opening_angle_rad);
  return cone;
}

/// The first contact with a plane is where the cone's side meets it, for rays too; a sheet without thickness
/// is met from both sides.
TEST_F(FastCones, MeetAPlane) {
  const EntityId plane = create(row_of(add_with_field(make_rectangle(40.0, 40.0)), {0.0, 0.0, -10.0}));
  for (const double tilt_rad : {0.0, 0.2, -0.5, 1.0}) {
    for (const double angle_rad : {0.0, 0.001, 0.1, 0.8}) {
      for (const double side : {1.0, -1.0}) {
        const glm::vec3 origin_m(0.0, 0.0, side > 0.0 ? 0.0 : -20.0);
        const glm::vec3 towards(std::sin(tilt_rad), 0.0, -side * std::cos(tilt_rad));
        const ConeReturn one = trace_cone(cone_from(origin_m, 2.0f * towards, angle_rad));
        const double half_rad = 0.5 * angle_rad;
        const double z_m = 10.0 * std::cos(half_rad) / std::cos(std::abs(tilt_rad) - half_rad);
        ASSERT_EQ(one.status, HitStatus::hit) << tilt_rad << ", " << angle_rad << ", " << side;
        EXPECT_EQ(one.entity, plane);
        EXPECT_TRUE(one.by_field) << tilt_rad << ", " << angle_rad << ", " << side;
        EXPECT_NEAR(2.0 * static_cast<double>(one.lambda), z_m, 1e-5 * z_m) << tilt_rad << ", " << angle_rad;
        EXPECT_EQ(one.front_face, side > 0.0);
      }
    }
  }
}

/// The footprint on a sphere: cones about an axis beside it meet it up to the tangent.
TEST_F(FastCones, MeetASphere) {
  const double radius_m = 1.0;
  create(row_of(add_with_field(make_sphere(radius_m, 5)), {20.0, 0.0, 0.0}));
  const double tangent_rad = std::asin(radius_m / 20.0);
  for (const double half_rad : {0.0, 0.002, 0.01, 0.03}) {
    for (const double beside_rad : {0.0, 0.02, 0.04, 0.06, 0.078}) {
      const glm::vec3 direction(std::cos(beside_rad), std::sin(beside_rad), 0.0);
      const ConeReturn one = trace_cone(cone_from({}, direction, 2.0 * half_rad));
      const double margin_rad = tangent_rad + half_rad - beside_rad;
      if (std::abs(margin_rad) < 5e-4) continue;
      ASSERT_EQ(one.status == HitStatus::hit, margin_rad > 0.0) << half_rad << ", " << beside_rad;
      if (one.status != HitStatus::hit) continue;
      const ConeReturn exact = trace_cone(cone_from({}, direction, 2.0 * half_rad), {});
      EXPECT_NEAR(one.lambda, exact.lambda, 0.02 + 20.0 * std::tan(half_rad))
          << half_rad << ", " << beside_rad;
    }
  }
}

/// A reflector of a millimetre in a beam of 0.05 degrees at 50 m, which 50 rays miss.
TEST_F(FastCones, FindASmallTarget) {
  const EntityId target = create(row_of(add_with_field(make_box({0.001, 0.001, 0.001})), {50.0, 0.01, 0.0}));
  const ConeReturn one = trace_cone(cone_from({}, {1.0f, 0.0f, 0.0f}, 0.052 / 57.3));
  ASSERT_EQ(one.status, HitStatus::hit);
  EXPECT_EQ(one.entity, target);
  EXPECT_NEAR(one.lambda, 50.0, 0.03);
}

/// Thin cones meet parts that are far thinner than the cells of the field, and pass holes.
TEST_F(FastCones, MeetThinPartsAndPassHoles) {
  create(row_of(add_with_field(make_small_station())));
  const ConeReturn wing = trace_cone(cone_from({9.0f, 30.0f, 3.3f}, {0.0f, -1.0f, 0.0f}, 1e-4));
  ASSERT_EQ(wing.status, HitStatus::hit);
  EXPECT_NEAR(wing.lambda, 29.9975, 0.02);
  EXPECT_TRUE(wing.by_field);

  open({});
  create(row_of(add_with_field(make_plate_with_hole(4.0, 0.4, 0.05))));
  const Cone through = cone_from({0.0f, 0.0f, 5.0f}, {0.0f, 0.0f, -1.0f}, 0.04);
  EXPECT_EQ(trace_cone(through).status, HitStatus::miss);
  Cone wider = through;
  wider.opening_angle_rad = 0.1f;
  EXPECT_EQ(trace_cone(wider).status, HitStatus::hit);
}

/// The part in front of the apex lies at the border of a cone of 57 degrees; the part behind the apex is
/// farther away. So the first step in the field ends shortly before the contact.
TEST_F(FastCones, MeetAPartAtTheBorderOfAWideCone) {
  TriangleMesh mesh = make_box({0.2, 0.2, 0.2});
  const TriangleMesh behind = mesh;
  const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
  for (glm::vec3& position : mesh.positions_m)
    position += glm::vec3(5.4f, 0.0f, -10.0f);
  for (const glm::vec3& position : behind.positions_m)
    mesh.positions_m.push_back(position + glm::vec3(0.0f, 0.0f, 20.0f));
  for (const glm::uvec3& triangle : behind.triangles)
    mesh.triangles.push_back(triangle + first);
  create(row_of(add_with_field(mesh)));
  const ConeReturn one = trace_cone(cone_from({}, {0.0f, 0.0f, -1.0f}, 1.0));
  ASSERT_EQ(one.status, HitStatus::hit);
  EXPECT_NEAR(one.lambda, 9.9, 1e-4);
  EXPECT_TRUE(one.by_field);
}

/// A cone whose apex is inside a body meets the surface from inside, whatever the sign of the field.
TEST_F(FastCones, BeginInsideOfABody) {
  create(row_of(add_with_field(make_sphere(2.0, 4))));
  const ConeReturn one = trace_cone(cone_from({}, {1.0f, 0.0f, 0.0f}, 0.02));
  ASSERT_EQ(one.status, HitStatus::hit);
  EXPECT_NEAR(one.lambda, 2.0, 0.02);
  EXPECT_FALSE(one.front_face);
}

/// A return has `by_field` if a field was used.
TEST_F(FastCones, TraceByTrianglesWhereThereIsNoField) {
  const TriangleMesh mesh = make_sphere(1.0, 3);
  const GeometryId without = add(mesh);
  const auto deforming = database().add_geometry(mesh, "deforming", {.deforms = true});
  ASSERT_TRUE(deforming.ok());
  const GeometryId with = add_with_field(mesh);
  create(row_of(without, {10.0, 0.0, 0.0}));
  create(row_of(deforming.value(), {20.0, 0.0, 0.0}));
  create(row_of(with, {30.0, 0.0, 0.0}));
  ConeQueryOptions options = fast_options;
  options.returns_per_cone = 3;
  const Cone cone = cone_from({}, {1.0f, 0.0f, 0.0f}, 0.01);
  const auto returns = trace_cones(std::span(&cone, 1), options);
  const auto exact = trace_cones(std::span(&cone, 1), {.returns_per_cone = 3});
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(returns[i].status, HitStatus::hit);
    EXPECT_EQ(returns[i].entity, exact[i].entity);
    EXPECT_EQ(returns[i].by_field, i == 2);
    EXPECT_FALSE(exact[i].by_field);
    EXPECT_NEAR(returns[i].lambda, exact[i].lambda, 0.01);
  }
  // A wide cone is searched by triangles.
  EXPECT_FALSE(trace_cone(cone_from({25.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, 2.0)).by_field);

  // A field that is built later is used from the next transaction on.
  ASSERT_TRUE(database().build_field(without, {}).ok());
  EXPECT_TRUE(trace_cones(std::span(&cone, 1), options)[0].by_field);
}

// ---- random worlds

struct RandomCase {
  const char* name;
  std::uint32_t entities;
  bool scaled;  ///< non-uniformly
};

class RandomFastCones : public FastCones, public testing::WithParamInterface<RandomCase> {};

/// At least 99 of 100 cones that are not tangent to an entity have the same first entity as in the exact
/// mode, and lambda within the bound that ConeMode::fast states.
TEST_P(RandomFastCones, AgreeWithTheExactMode) {
  Random random(48);
  const SceneOptions scene{.radius_m = GetParam().entities < 20 ? 4.0 : 12.0, .version_time = at_s(5.0)};
  std::vector<GeometryId> geometries;
  std::vector<double> cells_m;
  for (const TriangleMesh& mesh :
       {make_torus(0.8, 0.25, 32), make_plate_with_hole(2.0, 0.8, 0.2), make_sphere(0.9, 4),
        make_box({0.5, 1.0, 1.5}), make_rectangle(1.5, 1.0), make_cylinder(0.5, 1.5, 24)}) {
    geometries.push_back(add_with_field(mesh));
    cells_m.push_back(database().field(geometries.back())->cell_m);
  }
  std::vector<EntityRow> rows;
  double max_scale = 1.0;
  for (std::uint32_t i = 0; i < GetParam().entities; ++i) {
    EntityRow row = random_row(random, geometries, scene, rows);
    if (!GetParam().scaled) row.scale = glm::vec3(1.0f);
    row.mask = mask_all;
    max_scale = std::max({max_scale, static_cast<double>(row.scale.x), static_cast<double>(row.scale.y),
                          static_cast<double>(row.scale.z)});
    rows.push_back(row);
  }
  create(rows, scene.version_time);
  const auto states = database().snapshot({});
  std::vector<Cone> cones(6000);
  for (Cone& cone : cones) {
    cone = random_cone(random, states.value(), scene, scene.version_time, 0.5);
    cone.opening_angle_rad = std::min(cone.opening_angle_rad, 0.3f);
  }
  const auto with_angle = [&](float factor) {
    std::vector<Cone> changed = cones;
    for (Cone& cone : changed)
      cone.opening_angle_rad = factor * cone.opening_angle_rad + (factor > 1.0f ? 2e-4f : 0.0f);
    return trace_cones(changed, {});
  };
  const auto exact = trace_cones(cones, {});
  const auto narrower = with_angle(0.98f);
  const auto wider = with_angle(1.02f);
  const auto fast = trace_cones(cones, fast_options);
  const double cell_m = std::ranges::max(cells_m) * max_scale;
  std::size_t compared = 0, hits = 0, by_field = 0, other_entity = 0, beyond = 0;
  for (std::size_t i = 0; i < cones.size(); ++i) {
    ASSERT_NE(fast[i].status, HitStatus::incomplete);
    hits += exact[i].status == HitStatus::hit ? 1 : 0;
    by_field += fast[i].by_field ? 1 : 0;
    if (narrower[i].entity != exact[i].entity || wider[i].entity != exact[i].entity) continue;  // tangent
    ++compared;
    if (fast[i].entity != exact[i].entity || fast[i].status != exact[i].status) {
      ++other_entity;
      continue;
    }
    if (exact[i].status != HitStatus::hit) continue;
    const double length = static_cast<double>(glm::length(cones[i].direction));
    const double z_m = length * static_cast<double>(exact[i].lambda);
    const double half_rad = 0.5 * static_cast<double>(cones[i].opening_angle_rad);
    const double beam_m = z_m * std::tan(half_rad);
    // The angle of incidence is that of the triangle that was found.
    const bool carried = cones[i].carrier.valid();
    const double sine =
        carried
            ? 0.0
            : std::abs(static_cast<double>(glm::dot(glm::normalize(cones[i].direction), exact[i].n_world)));
    const double bound_m = 0.1 * cell_m / std::max(sine + std::tan(half_rad), 0.02) + beam_m + 1e-4 * z_m;
    const double difference_m =
        length * std::abs(static_cast<double>(fast[i].lambda) - static_cast<double>(exact[i].lambda));
    beyond += difference_m > bound_m ? 1 : 0;
  }
  RecordProperty("by_field", static_cast<int>(by_field));
  RecordProperty("other_entity", static_cast<int>(other_entity));
  RecordProperty("beyond", static_cast<int>(beyond));
  EXPECT_GT(compared, cones.size() / 2);
  EXPECT_GT(hits, cones.size() / 5);
  EXPECT_LT(hits, cones.size() * 4 / 5);
  EXPECT_GT(by_field, hits / 2);
  EXPECT_LT(other_entity, compared / 100) << compared << " compared";
  EXPECT_LT(beyond, compared / 100) << compared << " compared";
}

INSTANTIATE_TEST_SUITE_P(Worlds, RandomFastCones,
                         testing::Values(RandomCase{"nine", 9, false}, RandomCase{"nine_scaled", 9, true},
                                         RandomCase{"two_hundred", 200, false},
                                         RandomCase{"two_hundred_scaled", 200, true}),
                         [](const auto& one) { return std::string(one.param.name); });

/// With fractions the returns are those of the exact mode, where contacts agree.
TEST_F(FastCones, ShareTheBeam) {
  create(row_of(add_with_field(make_rectangle(2.0, 2.0)), {0.0, 1.0, -10.0}));
  create(row_of(add_with_field(make_rectangle(20.0, 20.0)), {0.0, 0.0, -20.0}));
  ConeQueryOptions options = fast_options;
  options.returns_per_cone = 2;
  options.fractions = true;
  const Cone cone = cone_from({}, {0.0f, 0.0f, -1.0f}, 0.05);
  const auto returns = trace_cones(std::span(&cone, 1), options);
  EXPECT_NEAR(returns[0].fraction, 0.5f, 1.0f / 64.0f);
  EXPECT_NEAR(returns[1].fraction, 0.5f, 1.0f / 64.0f);
  EXPECT_TRUE(returns[0].by_field && returns[1].by_field);
}

}  // namespace
}  // namespace rtstdb::test
