// The BLAS of deforming geometry on the device, after each of many shapes: boxes contain their children, a
// tree that becomes expensive is rebuilt in its place, and nothing else changes.

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <map>

#include "rtstdb/geometry/closed_mesh.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/structure_walk.hpp"

namespace rtstdb::test {
namespace {

/// Has no entities, and settable shapes.
class Shapes final : public store::RowSource {
 public:
  void set(std::uint32_t geometry, Version version, const std::vector<glm::vec3>& positions_m) {
    shapes_[geometry] = {version, positions_m};
  }

  Version version() const noexcept override { return 0; }
  WorldTime time() const noexcept override { return {}; }
  std::uint32_t index_limit() const noexcept override { return 0; }
  const EntityState* row(std::uint32_t) const noexcept override { return nullptr; }
  bool changed_between(Version, std::vector<std::uint32_t>&) const noexcept override { return true; }
  store::Shape shape(GeometryId geometry) const noexcept override { return shapes_.at(geometry.index); }

 private:
  std::map<std::uint32_t, store::Shape> shapes_;
};

TriangleMesh random_triangles(Random& random, std::uint32_t count) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::vec3 center(random.vector());
    const auto size = static_cast<float>(random.magnitude(0.01, 0.5));
    for (int corner = 0; corner < 3; ++corner)
      mesh.positions_m.push_back(center + size * glm::vec3(random.vector()));
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

/// Exchanges the positions of whole triangles of a random mesh, so that nothing of its tree is useful.
void shuffle_triangles(std::vector<glm::vec3>& positions, Random& random) {
  for (std::size_t i = positions.size() / 3; i > 1; --i) {
    const std::size_t other = random.below(i);
    std::swap_ranges(positions.begin() + static_cast<std::ptrdiff_t>(3 * (i - 1)),
                     positions.begin() + static_cast<std::ptrdiff_t>(3 * (i - 1) + 3),
                     positions.begin() + static_cast<std::ptrdiff_t>(3 * other));
  }
}

/// A random shape of the mesh, of one of ten kinds.
std::vector<glm::vec3> deformed(const TriangleMesh& mesh, Random& random) {
  std::vector<glm::vec3> positions = mesh.positions_m;
  const std::size_t kind = random.below(10);
  if (kind == 9) shuffle_triangles(positions, random);
  const auto size = static_cast<float>(random.magnitude(1e-4, 1e4));
  const glm::vec3 place(1e3 * random.vector());
  const glm::vec3 wave(random.vector());
  for (glm::vec3& p : positions) {
    if (kind == 0) p += 0.3f * std::sin(3.0f * glm::dot(p, wave)) * glm::normalize(wave);
    if (kind == 1) p += 0.01f * glm::vec3(random.vector());
    if (kind == 2) p = glm::vec3(random.vector());
    if (kind == 3) p = size * p + place;
    if (kind == 4) p = place;
    if (kind == 5) p.z = 0.0f;
    if (kind == 6) p = {p.x, place.y, place.z};
    if (kind == 7) p = {p.y * std::cos(p.z) - p.x * std::sin(p.z), p.x, p.z};
  }
  if (kind == 8 && !positions.empty()) positions.front() = glm::vec3(9e4f, -9e4f, 1.0f);
  return positions;
}

class DeformingBlas : public StructureTest {
 protected:
  const GeometryOptions deforming{.deforms = true};

  void show(std::uint32_t geometry, Version version, const TriangleMesh& mesh) {
    shapes_.set(geometry, version, mesh.positions_m);
    ASSERT_TRUE(pool_.show(device(), shapes_, submit_));
  }
  /// Checks the tree at `root`. Returns its cost for a ray, 0 for a tree without area.
  double check(std::uint32_t root, const TriangleMesh& mesh) {
    StructureWalk walk(mesh, read(pool_.nodes()), read(pool_.triangles()));
    const ExactBox box = walk.visit(root, 1);
    walk.expect_valid();
    const glm::dvec3 extent = box.hi - box.lo;
    return extent.x * extent.y + extent.y * extent.z + extent.z * extent.x > 0.0 ? walk.cost(box) : 0.0;
  }
  double check_shown(std::uint32_t geometry, const TriangleMesh& mesh) {
    const auto record = pool_.geometries().host_as<shared::GeometryRecord>()[geometry];
    const Bounds bounds = bounds_of(mesh);
    EXPECT_EQ(pool_.bounds(geometry).minimum_m, bounds.minimum_m);
    EXPECT_EQ(pool_.bounds(geometry).maximum_m, bounds.maximum_m);
    EXPECT_EQ(record.box_center_m, 0.5f * (bounds.minimum_m + bounds.maximum_m));
    EXPECT_EQ(record.box_half_m, 0.5f * (bounds.maximum_m - bounds.minimum_m));
    EXPECT_EQ(record.closed != 0, is_closed(mesh));
    return check(record.root, mesh);
  }

  Shapes shapes_;
  Random random_{4711};
};

TEST_F(DeformingBlas, IsValidAfterEachOfManyShapes) {
  std::vector<TriangleMesh> meshes{make_sphere(1.0, 3), make_box(glm::dvec3(1.0)), make_rectangle(2.0, 1.0)};
  for (const std::uint32_t count : {1u, 2u, 3u, 4u, 5u, 8u, 9u, 33u, 64u, 65u, 1025u, 6000u})
    meshes.push_back(random_triangles(random_, count));
  std::uint64_t refits = 0, builds = 0;
  for (const TriangleMesh& mesh : meshes) {
    SCOPED_TRACE(mesh.triangles.size());
    new_pool();
    const std::uint32_t fixed = add(make_sphere(1.0, 1));
    const std::uint32_t geometry = add(mesh, deforming);
    const std::uint32_t also_fixed = add(make_sphere(2.0, 1));
    TriangleMesh now = mesh;
    show(geometry, 0, now);
    check_shown(geometry, now);
    for (Version version = 1; version <= 24; ++version) {
      const TriangleMesh before = now;
      const std::uint32_t root_before = root_of(geometry);
      now.positions_m = version % 8 == 0 ? mesh.positions_m : deformed(mesh, random_);
      show(geometry, version, now);
      check_shown(geometry, now);
      EXPECT_NE(root_of(geometry), root_before);
      check(root_before, before);
      // Back and forth: both shapes are on the device.
      const std::uint64_t refits_before = pool_.counts().refits;
      show(geometry, version - 1, before);
      check_shown(geometry, before);
      show(geometry, version, now);
      EXPECT_EQ(pool_.counts().refits, refits_before);
      if (HasFailure()) FAIL() << "shape " << version;
    }
    check(root_of(fixed), make_sphere(1.0, 1));
    check(root_of(also_fixed), make_sphere(2.0, 1));
    refits += pool_.counts().refits;
    builds += pool_.counts().builds;
  }
  EXPECT_EQ(refits, 24u * meshes.size());
  EXPECT_GT(builds, refits / 20);
  EXPECT_LT(builds, refits / 2);
}

TEST_F(DeformingBlas, IsRebuiltWhenItBecomesExpensive) {
  const TriangleMesh mesh = random_triangles(random_, 5000);
  const std::uint32_t geometry = add(mesh, deforming);
  const std::uint32_t never_rebuilt = add(mesh, {.deforms = true, .rebuild_growth = INFINITY});
  TriangleMesh now = mesh;
  shapes_.set(never_rebuilt, 0, mesh.positions_m);
  // Another size and place: the tree is as good as before.
  for (glm::vec3& p : now.positions_m)
    p = 1000.0f * p + glm::vec3(5e3f);
  show(geometry, 1, now);
  EXPECT_EQ(pool_.counts().builds, 0u);
  now = mesh;
  shuffle_triangles(now.positions_m, random_);
  shapes_.set(never_rebuilt, 2, now.positions_m);
  show(geometry, 2, now);
  EXPECT_EQ(pool_.counts().builds, 1u);
  const double rebuilt = check_shown(geometry, now);
  const double fresh = check(root_of(add(now)), now);
  EXPECT_NEAR(rebuilt, fresh, 1e-6 * fresh);
  EXPECT_GT(check_shown(never_rebuilt, now), 3.0 * fresh);
}

/// Any tree over triangles as large as the mesh is expensive, and useless for other shapes.
TEST_F(DeformingBlas, IsCheapAgainAfterARandomShape) {
  const TriangleMesh body = make_sphere(1.0, 4);
  const double fresh = check(root_of(add(body)), body);
  const std::uint32_t geometry = add(body, deforming);
  TriangleMesh random_shape = body;
  Version version = 0;
  for (int round = 0; round < 3; ++round) {
    for (int place = 0; place < 2; ++place) {
      for (glm::vec3& p : random_shape.positions_m)
        p = glm::vec3(random_.vector());
      show(geometry, ++version, random_shape);
      EXPECT_LT(check_shown(geometry, random_shape), 1.5 * check(root_of(add(random_shape)), random_shape));
    }
    for (int place = 0; place < 2; ++place) {
      show(geometry, ++version, body);
      EXPECT_LT(check_shown(geometry, body), 1.5 * fresh);
    }
  }
}

TEST_F(DeformingBlas, IsCheapAgainAfterAPoint) {
  const TriangleMesh body = make_sphere(1.0, 4);
  const double fresh = check(root_of(add(body)), body);
  TriangleMesh point = body;
  for (glm::vec3& p : point.positions_m)
    p = glm::vec3(1.0f);
  // In both places of the shape.
  const std::uint32_t geometry = add(body, deforming);
  Version version = 0;
  for (int round = 0; round < 3; ++round) {
    show(geometry, ++version, point);
    EXPECT_EQ(check_shown(geometry, point), 0.0);
    show(geometry, ++version, point);
    show(geometry, ++version, body);
    EXPECT_LT(check_shown(geometry, body), 1.5 * fresh);
    show(geometry, ++version, body);
    EXPECT_LT(check_shown(geometry, body), 1.5 * fresh);
  }
}

TEST_F(DeformingBlas, IsTheSameInEveryRun) {
  const TriangleMesh mesh = random_triangles(random_, 5000);
  const auto run = [&] {
    new_pool();
    Random random(99);
    const std::uint32_t geometry = add(mesh, deforming);
    for (Version version = 1; version <= 12; ++version) {
      TriangleMesh now = mesh;
      now.positions_m = deformed(mesh, random);
      show(geometry, version, now);
    }
    return std::pair(read(pool_.nodes()), read(pool_.triangles()));
  };
  const auto used_part = [&](const Words& words, std::size_t count) {
    return Words(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(count));
  };
  const auto first = run();
  const auto second = run();
  const std::size_t triangle_words = 4 * shared::triangle_texels * mesh.triangles.size();
  EXPECT_EQ(used_part(first.second, triangle_words), used_part(second.second, triangle_words));
  const std::size_t node_words = 4 * shared::node_texels * (mesh.triangles.size() / 16);
  EXPECT_EQ(used_part(first.first, node_words), used_part(second.first, node_words));
}

TEST_F(DeformingBlas, IsValidAfterThePoolGrows) {
  std::vector<TriangleMesh> meshes;
  for (std::uint32_t i = 0; i < 5; ++i) {
    meshes.push_back(random_triangles(random_, 100u << (2 * i)));
    ASSERT_EQ(add(meshes.back(), deforming), i);
    shapes_.set(i, 0, meshes.back().positions_m);
  }
  const std::uint32_t large = add(random_triangles(random_, 200'000));
  for (Version version = 1; version <= 3; ++version) {
    for (std::uint32_t i = 0; i < meshes.size(); ++i) {
      meshes[i].positions_m = deformed(meshes[i], random_);
      shapes_.set(i, version, meshes[i].positions_m);
    }
    ASSERT_TRUE(pool_.show(device(), shapes_, submit_));
    for (std::uint32_t i = 0; i < meshes.size(); ++i)
      check_shown(i, meshes[i]);
    ASSERT_FALSE(HasFailure()) << "version " << version;
  }
  EXPECT_GT(root_of(large), root_of(4));
}

}  // namespace
}  // namespace rtstdb::test
