// Random points in random worlds: each answer of nearest queries is compared with the oracle.

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <numeric>
#include <ostream>
#include <string>
#include <tuple>

#include "tests/gpu/random_queries.hpp"
#include "tests/support/real_data.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  RandomWorld world;
  NearestTarget target;
  std::uint32_t k;
  std::size_t points;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

constexpr Case cases[] = {
    {"center_of_sixty_k1", {31, 60, 5.0}, NearestTarget::center, 1, 20'000},
    {"center_of_sixty_k8", {32, 60, 5.0}, NearestTarget::center, 8, 10'000},
    {"center_of_three_thousand_k32", {33, 3000, 36.0}, NearestTarget::center, 32, 2'000},
    {"bounds_of_forty_k1", {34, 40, 5.0}, NearestTarget::bounds, 1, 20'000},
    {"bounds_of_six_hundred_k8", {35, 600, 16.0}, NearestTarget::bounds, 8, 5'000},
    {"bounds_of_forty_k32", {36, 40, 5.0}, NearestTarget::bounds, 32, 4'000},
    {"surface_of_one_k1", {36, 1, 2.0}, NearestTarget::surface, 1, 10'000},
    {"surface_of_forty_k1", {38, 40, 5.0}, NearestTarget::surface, 1, 10'000},
    {"surface_of_forty_k5", {39, 40, 5.0}, NearestTarget::surface, 5, 5'000},
    {"surface_of_six_hundred_k2", {40, 600, 16.0}, NearestTarget::surface, 2, 5'000},
    {"surface_of_three_thousand_k8", {41, 3000, 36.0}, NearestTarget::surface, 8, 2'000},
    {"triangle_of_forty_k1", {42, 40, 5.0}, NearestTarget::triangle, 1, 10'000},
    {"triangle_of_forty_k4", {43, 40, 5.0}, NearestTarget::triangle, 4, 5'000},
    {"triangle_of_six_hundred_k32", {44, 600, 16.0}, NearestTarget::triangle, 32, 2'000},
};

class RandomNearest : public RandomQueries, public testing::WithParamInterface<Case> {
 protected:
  /// The oracle accepts any of the triangles that share the nearest point.
  static constexpr double max_too_close(NearestTarget target) {
    return target == NearestTarget::triangle ? 0.1 : 0.02;
  }
  Tally run_points(bool is_signed) {
    fill(GetParam().world);
    const Tally tally = run_random(
        NearestQueryOptions{
            .name = "points", .target = GetParam().target, .k = GetParam().k, .is_signed = is_signed},
        GetParam().points);
    expect_informative(tally, max_too_close(GetParam().target));
    return tally;
  }
};

TEST_P(RandomNearest, AgreeWithTheOracle) {
  EXPECT_EQ(run_points(false).inside, 0u) << "a sign without is_signed";
}

TEST_P(RandomNearest, SignsAgreeWithTheOracle) {
  if (GetParam().target < NearestTarget::surface) return;  // has no sign
  const Tally tally = run_points(true);
  EXPECT_GT(tally.inside, tally.elements / 50) << "hardly any point inside";
}

INSTANTIATE_TEST_SUITE_P(Worlds, RandomNearest, testing::ValuesIn(cases),
                         [](const auto& test_case) { return std::string(test_case.param.name); });

/// Scanned and modelled bodies of a thousand to a million triangles.
class NearestOnRealMeshes : public DatabaseTest, public testing::WithParamInterface<std::filesystem::path> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(NearestOnRealMeshes);
INSTANTIATE_TEST_SUITE_P(Found, NearestOnRealMeshes, testing::ValuesIn(hil::tests::real_mesh_folders()),
                         [](const auto&) { return "meshes"; });

TEST_P(NearestOnRealMeshes, AgreeWithTheOracle) {
  Random random(79);
  std::size_t meshes = 0;
  std::size_t inside = 0;
  for (const auto& entry : std::filesystem::directory_iterator(GetParam())) {
    if (entry.path().extension() != ".obj") continue;
    open({});
    const auto mesh = load_mesh(entry.path());
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    const Bounds bounds = bounds_of(mesh.value());
    const float size_m = glm::length(bounds.maximum_m - bounds.minimum_m);
    EntityRow row = row_of(add(mesh.value()));
    row.scale = {1.0, 1.5, 0.8};
    create(row);
    const NearestQueryOptions options{
        .name = "nearest", .capacity = 400, .target = NearestTarget::surface, .k = 1, .is_signed = true};
    const auto query = prepare(options);
    const auto points = query->points();
    for (Nearest& point : points) {
      const glm::vec3 corner = mesh.value().positions_m[random.below(mesh.value().positions_m.size())];
      const auto off = static_cast<float>(random.magnitude(1e-3, 1.0)) * size_m;
      point.point_m = glm::vec3(row.scale) * corner + off * glm::vec3(random.direction());
    }
    const Outcome outcome = run(*query, 400);
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    const auto answers = query->answers();
    const Tally tally = judge(world(), points, answers, options);
    EXPECT_EQ(tally.hits, 400u);
    EXPECT_LT(tally.too_close, 60u) << entry.path();
    inside += static_cast<std::size_t>(std::ranges::count_if(
        answers, [](const auto& answer) { return answer.neighbors[0].distance_m < 0.0f; }));
    ++meshes;
  }
  EXPECT_GT(meshes, 0u);
  EXPECT_GT(inside, 100u) << "of all meshes together";
}

}  // namespace
}  // namespace rtstdb::test
