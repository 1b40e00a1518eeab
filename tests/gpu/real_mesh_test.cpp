// Rays at real meshes, compared with the oracle.

#include <filesystem>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/real_data.hpp"

namespace rtstdb::test {
namespace {

class RealMeshes : public DatabaseTest, public testing::WithParamInterface<std::filesystem::path> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RealMeshes);
INSTANTIATE_TEST_SUITE_P(Found, RealMeshes, testing::ValuesIn(hil::tests::real_mesh_folders()),
                         [](const auto&) { return "meshes"; });

TEST_P(RealMeshes, AreHitAsInTheOracle) {
  Random random(31);
  std::size_t meshes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(GetParam())) {
    if (entry.path().extension() != ".obj") continue;
    open({});
    const auto mesh = load_mesh(entry.path());
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    create(row_of(add(mesh.value())));
    const Bounds bounds = bounds_of(mesh.value());
    const glm::dvec3 center_m = 0.5 * (glm::dvec3(bounds.minimum_m) + glm::dvec3(bounds.maximum_m));
    const glm::dvec3 half_m = 0.5 * (glm::dvec3(bounds.maximum_m) - glm::dvec3(bounds.minimum_m));
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < 5000; ++i) {
      const glm::dvec3 from_m = center_m + 3.0 * glm::length(half_m) * random.direction();
      const glm::dvec3 to_m =
          center_m + half_m * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      rays.push_back(ray_from(from_m, to_m - from_m));
    }
    const Tally tally = judge(world(), rays, trace(rays));
    EXPECT_GT(tally.hits, 1000u) << entry.path();
    EXPECT_LT(tally.too_close, 25u) << entry.path();
    ++meshes;
  }
  EXPECT_GT(meshes, 0u);
}

}  // namespace
}  // namespace rtstdb::test
