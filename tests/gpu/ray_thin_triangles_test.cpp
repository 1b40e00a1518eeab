// Rays and triangles of little or no area: no ray hits a triangle without area, and thin triangles have
// normals.

#include <glm/geometric.hpp>

#include <cmath>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

constexpr int triangle_count = 300;

/// Triples of different corners, exactly on a line: integer multiples of 2^-10 m.
std::vector<glm::vec3> corners_on_lines(Random& random) {
  constexpr double unit_m = 1.0 / 1024.0;
  const auto integers = [&](int max) {
    glm::dvec3 at;
    for (int axis = 0; axis < 3; ++axis)
      at[axis] = std::round(random.uniform(-max, max));
    return at;
  };
  std::vector<glm::vec3> corners;
  for (int i = 0; i < triangle_count; ++i) {
    const glm::dvec3 first = integers(5000);
    const glm::dvec3 step = integers(600) + glm::dvec3(0.0, 0.0, 0.5);
    for (const double along : {0.0, 2.0, 6.0})
      corners.emplace_back((first + along * step) * unit_m);
  }
  return corners;
}

TriangleMesh mesh_of(std::vector<glm::vec3> corners) {
  TriangleMesh mesh{std::move(corners), {}};
  for (std::uint32_t i = 0; i < mesh.positions_m.size(); i += 3)
    mesh.triangles.emplace_back(i, i + 1, i + 2);
  return mesh;
}

/// Rays to points between the first and the last of three corners.
std::vector<Ray> rays_at(std::span<const glm::vec3> corners, int per_triangle, Random& random) {
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    for (int k = 0; k < per_triangle; ++k) {
      const glm::dvec3 a(corners[i]);
      const glm::dvec3 to_m = a + random.uniform(0.0, 1.0) * (glm::dvec3(corners[i + 2]) - a);
      const glm::dvec3 from_m = 20.0 * random.vector();
      rays.push_back(ray_from(from_m, to_m - from_m));
    }
  }
  return rays;
}

class ThinTriangles : public DatabaseTest {
 protected:
  std::size_t hits_of(std::span<const Ray> rays, RayMode mode) {
    const auto query = prepare_rays(mode);
    return static_cast<std::size_t>(std::ranges::count(trace(*query, rays), HitStatus::hit, &RayHit::status));
  }
  void expect_no_hits(std::span<const Ray> rays) {
    EXPECT_EQ(std::ranges::count(trace(rays), HitStatus::hit, &RayHit::status), 0);
    for (const RayMode mode : {RayMode::closest, RayMode::any, RayMode::first})
      EXPECT_EQ(hits_of(rays, mode), 0u) << "mode " << static_cast<int>(mode);
  }
};

TEST_F(ThinTriangles, WithoutAreaAreNotHit) {
  Random random(31);
  auto corners = corners_on_lines(random);
  const std::vector<Ray> rays = rays_at(corners, 20, random);
  // A mesh of triangles without area is refused.
  corners.insert(corners.end(), {{900, 900, 900}, {901, 900, 900}, {900, 901, 900}});
  for (const bool use_subgroup_kernels : {true, false}) {
    open({}, {.use_subgroup_kernels = use_subgroup_kernels});
    create(row_of(add(mesh_of(corners))));
    expect_no_hits(rays);
  }
}

TEST_F(ThinTriangles, ThatLoseTheirAreaAreNotHit) {
  Random random(32);
  const auto corners = corners_on_lines(random);
  auto before = corners;
  for (std::size_t i = 1; i < before.size(); i += 3)
    before[i] += glm::vec3(0.3f, -0.2f, 0.25f);
  const auto geometry = database().add_geometry(mesh_of(before), "lines", {.deforms = true});
  ASSERT_TRUE(geometry.ok());
  create(row_of(geometry.value()));
  const std::vector<Ray> rays = rays_at(before, 20, random);
  EXPECT_GT(hits_of(rays, RayMode::closest), rays.size() / 10);
  const auto transaction =
      database().make_transaction({.max_geometry_updates = 1, .max_positions = 3 * triangle_count});
  transaction->begin({});
  transaction->update_geometry(geometry.value(), corners);
  const Outcome outcome = database().execute(*transaction);
  ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
  expect_no_hits(rays_at(corners, 20, random));
}

TEST_F(ThinTriangles, HaveNormals) {
  Random random(33);
  std::vector<glm::vec3> corners;
  for (int i = 0; i < triangle_count; ++i) {
    const glm::dvec3 a = 5.0 * random.vector();
    const glm::dvec3 along = 10.0 * random.direction();
    const glm::dvec3 aside = random.magnitude(1e-6, 1e-3) * random.direction();
    corners.insert(corners.end(), {glm::vec3(a), glm::vec3(a + along), glm::vec3(a + 0.5 * along + aside)});
  }
  EntityRow row = row_of(add(mesh_of(corners)));
  row.scale = {1.0, 3.0, 0.5};
  create(row);
  auto scaled = corners;
  for (glm::vec3& corner : scaled)
    corner *= glm::vec3(row.scale);
  std::size_t hits = 0;
  for (const RayHit& hit : trace(rays_at(scaled, 60, random))) {
    if (hit.status != HitStatus::hit) continue;
    ++hits;
    const glm::dvec3 a(corners[3 * hit.triangle]);
    const glm::dvec3 b(corners[3 * hit.triangle + 1]);
    const glm::dvec3 c(corners[3 * hit.triangle + 2]);
    const glm::dvec3 n = glm::normalize(glm::cross(b - a, c - a) / row.scale);
    ASSERT_GT(glm::dot(n, glm::dvec3(hit.n_world)), 1.0 - 1e-6) << "triangle " << hit.triangle;
    ASSERT_NEAR(glm::length(hit.n_world), 1.0f, 1e-5f);
  }
  EXPECT_GT(hits, 1000u);
}

}  // namespace
}  // namespace rtstdb::test
