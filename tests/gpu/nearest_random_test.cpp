// Random worlds, random points: every nearest answer of the GPU against the oracle's.

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <ostream>
#include <string>
#include <tuple>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  std::uint64_t seed;
  std::uint32_t entities;
  double radius_m;
  NearestTarget target;
  std::uint32_t k;
  std::size_t points;
};

std::ostream& operator<<(std::ostream& out, const Case& one) {
  return out << one.name;
}

constexpr Case cases[] = {
    {"center_of_sixty_k1", 31, 60, 5.0, NearestTarget::center, 1, 20'000},
    {"center_of_sixty_k8", 32, 60, 5.0, NearestTarget::center, 8, 10'000},
    {"center_of_three_thousand_k32", 33, 3000, 36.0, NearestTarget::center, 32, 2'000},
    {"bounds_of_forty_k1", 34, 40, 5.0, NearestTarget::bounds, 1, 20'000},
    {"bounds_of_six_hundred_k8", 35, 600, 16.0, NearestTarget::bounds, 8, 5'000},
    {"bounds_of_forty_k32", 36, 40, 5.0, NearestTarget::bounds, 32, 4'000},
    {"surface_of_one_k1", 37, 1, 2.0, NearestTarget::surface, 1, 10'000},
    {"surface_of_forty_k1", 38, 40, 5.0, NearestTarget::surface, 1, 10'000},
    {"surface_of_forty_k5", 39, 40, 5.0, NearestTarget::surface, 5, 5'000},
    {"surface_of_six_hundred_k2", 40, 600, 16.0, NearestTarget::surface, 2, 5'000},
    {"surface_of_three_thousand_k8", 41, 3000, 36.0, NearestTarget::surface, 8, 2'000},
    {"triangle_of_forty_k1", 42, 40, 5.0, NearestTarget::triangle, 1, 10'000},
    {"triangle_of_forty_k4", 43, 40, 5.0, NearestTarget::triangle, 4, 5'000},
    {"triangle_of_six_hundred_k32", 44, 600, 16.0, NearestTarget::triangle, 32, 2'000},
};

class RandomNearest : public DatabaseTest, public testing::WithParamInterface<Case> {
 protected:
  static constexpr std::uint32_t batch = 500;
  SceneOptions options_{.radius_m = GetParam().radius_m, .version_time = at_s(1000.25)};
  Random random_{GetParam().seed};

  void SetUp() override {
    DatabaseTest::SetUp();
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random_))
      geometries.push_back(add(mesh));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < GetParam().entities; ++i)
      rows.push_back(random_row(random_, geometries, options_, rows));
    create(rows, options_.version_time);
  }

  Tally ask(bool is_signed) {
    const NearestQueryOptions asked{.name = "nearest",
                                    .capacity = batch,
                                    .target = GetParam().target,
                                    .k = GetParam().k,
                                    .is_signed = is_signed};
    auto query = database().prepare(asked);
    EXPECT_TRUE(query.ok());
    const oracle::World everything = world();
    Tally tally;
    for (std::size_t done = 0; done < GetParam().points && !HasFailure(); done += batch) {
      const double window_s = random_.uniform(0.0, 1.0);
      const WorldTime first = options_.version_time + Nanoseconds(random_.below(2) * 5'300'000'000);
      const auto points = query.value()->points();
      for (Nearest& point : points)
        point = random_point(random_, everything.entities(), options_, first, window_s);
      const Outcome outcome =
          execute([&](Transaction& transaction) { transaction.ask(*query.value(), batch); });
      EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
      tally += judge(everything, points, query.value()->answers(), asked);
      for (const NearestAnswer& answer : query.value()->answers())
        inside_ += answer.neighbors.empty() || answer.neighbors[0].distance_m >= 0.0f ? 0 : 1;
    }
    EXPECT_GE(tally.asked, HasFailure() ? 0 : GetParam().points);
    EXPECT_TRUE(HasFailure() || (tally.hits > tally.asked / 5 && tally.hits < tally.asked * 9 / 10))
        << "a world that shows little: " << tally.hits << " of " << tally.asked;
    // Triangles that meet at the nearest point differ by rounding alone.
    EXPECT_LT(tally.too_close, tally.asked / (GetParam().target == NearestTarget::triangle ? 10 : 50));
    RecordProperty("too_close", std::to_string(tally.too_close));
    return tally;
  }
  std::size_t inside_ = 0;
};

TEST_P(RandomNearest, AgreesWithTheOracle) {
  ask(false);
  EXPECT_EQ(inside_, 0u) << "nobody asked for a sign";
}

TEST_P(RandomNearest, SignAgreesWithTheOracle) {
  if (GetParam().target < NearestTarget::surface) {
    const auto query = database().prepare(
        NearestQueryOptions{.name = "signed", .capacity = 1, .target = GetParam().target, .is_signed = true});
    ASSERT_FALSE(query.ok());
    EXPECT_EQ(query.error().code, ErrorCode::bad_input);
    return;
  }
  const Tally tally = ask(true);
  EXPECT_GT(inside_, tally.asked / 50) << "hardly a point inside";
}

INSTANTIATE_TEST_SUITE_P(Worlds, RandomNearest, testing::ValuesIn(cases),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace rtstdb::test
