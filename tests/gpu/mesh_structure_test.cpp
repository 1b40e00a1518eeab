// Structures over single meshes of every kind, from one triangle to the large ones that people use.

#include <filesystem>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/real_data.hpp"

namespace rtstdb::test {
namespace {

class MeshStructures : public DatabaseTest {
 protected:
  /// Rays at the mesh from all around.
  Tally look_at(const TriangleMesh& mesh, std::size_t count) {
    const Bounds bounds = bounds_of(mesh);
    const glm::dvec3 middle_m = 0.5 * (glm::dvec3(bounds.minimum_m) + glm::dvec3(bounds.maximum_m));
    const glm::dvec3 half_m = 0.5 * (glm::dvec3(bounds.maximum_m) - glm::dvec3(bounds.minimum_m));
    const double size_m = glm::length(half_m);
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 from_m = middle_m + 3.0 * size_m * random_.direction();
      const glm::dvec3 to_m = middle_m + half_m * glm::dvec3(random_.uniform(-1, 1), random_.uniform(-1, 1),
                                                             random_.uniform(-1, 1));
      rays.push_back(ray_from(from_m, to_m - from_m));
    }
    return judge(world(), rays, trace(rays));
  }
  Random random_{31};
};

/// Every number of triangles around the sizes at which leaves, nodes and sort tiles fill up.
TEST_F(MeshStructures, OfEverySize) {
  std::vector<std::uint32_t> counts;
  for (std::uint32_t i = 1; i <= 40; ++i)
    counts.push_back(i);
  counts.insert(counts.end(), {63, 64, 65, 127, 255, 256, 257, 2047, 2048, 2049, 4097, 20'000});
  EntityId before;
  std::size_t hits = 0;
  for (const std::uint32_t count : counts) {
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
      const glm::vec3 center(random_.vector());
      for (int corner = 0; corner < 3; ++corner)
        mesh.positions_m.push_back(center + glm::vec3(0.3 * random_.vector()));
      mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    if (before.valid()) remove(before, {});
    before = create(row_of(add(mesh)));
    hits += look_at(mesh, 100).hits;
    if (HasFailure()) FAIL() << "with " << count << " triangles";
  }
  EXPECT_GT(hits, 500u);
}

/// Codes that are all the same, all on a line, and as far apart as they can be.
TEST_F(MeshStructures, OfEverySpread) {
  const std::function<glm::dvec3(std::uint32_t)> places[] = {
      [](std::uint32_t) { return glm::dvec3(1.0, 2.0, 3.0); },
      [](std::uint32_t i) { return glm::dvec3(0.01 * i, 0.0, 0.0); },
      [](std::uint32_t i) { return glm::dvec3(std::exp2(-0.05 * i), 0.0, 0.0); },
      [](std::uint32_t i) { return glm::dvec3(i % 2 == 0 ? 1e4 : -1e4, 0.01 * i, 0.0); },
      [](std::uint32_t i) { return glm::dvec3(0.0, 0.0, i == 7 ? 9e4 : 0.001 * i); },
  };
  EntityId before;
  for (const auto& place : places) {
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < 3000; ++i) {
      const glm::vec3 center(place(i));
      for (int corner = 0; corner < 3; ++corner)
        mesh.positions_m.push_back(center + glm::vec3(0.2 * random_.vector()));
      mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    if (before.valid()) remove(before, {});
    before = create(row_of(add(mesh)));
    std::vector<Ray> rays;
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const glm::dvec3 target_m = place(i) + 0.2 * random_.vector();
      const glm::dvec3 from_m = target_m + 5.0 * random_.direction();
      rays.push_back(ray_from(from_m, target_m - from_m));
    }
    const Tally tally = judge(world(), rays, trace(rays));
    EXPECT_GT(tally.hits, 400u);
  }
}

class RealMeshStructures : public MeshStructures,
                           public testing::WithParamInterface<std::filesystem::path> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RealMeshStructures);
INSTANTIATE_TEST_SUITE_P(Found, RealMeshStructures, testing::ValuesIn(hil::test::real_mesh_folders()),
                         [](const auto&) { return "meshes"; });

TEST_P(RealMeshStructures, AnswerLikeTheOracle) {
  std::size_t meshes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(GetParam())) {
    if (entry.path().extension() != ".obj") continue;
    open({});
    const auto mesh = load_mesh(entry.path());
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    create(row_of(add(mesh.value())));
    const Tally tally = look_at(mesh.value(), 5000);
    EXPECT_GT(tally.hits, 1000u) << entry.path();
    EXPECT_LT(tally.too_close, 25u) << entry.path();
    ++meshes;
  }
  EXPECT_GT(meshes, 0u);
}

}  // namespace
}  // namespace rtstdb::test
