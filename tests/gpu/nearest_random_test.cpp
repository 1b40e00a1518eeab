// Random worlds, random points: every nearest answer of the GPU against the oracle's.

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <numeric>
#include <ostream>
#include <string>
#include <tuple>

#include "tests/gpu/random_questions.hpp"
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

std::ostream& operator<<(std::ostream& out, const Case& one) {
  return out << one.name;
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

class RandomNearest : public RandomQuestions, public testing::WithParamInterface<Case> {
 protected:
  /// Of triangles that meet at the nearest point, any may be named.
  static constexpr double max_too_close(NearestTarget target) {
    return target == NearestTarget::triangle ? 0.1 : 0.02;
  }
  Tally ask_points(bool is_signed) {
    fill(GetParam().world);
    const Tally tally = ask(
        NearestQueryOptions{
            .name = "points", .target = GetParam().target, .k = GetParam().k, .is_signed = is_signed},
        GetParam().points);
    expect_telling(tally, max_too_close(GetParam().target));
    return tally;
  }
};

TEST_P(RandomNearest, AgreesWithTheOracle) {
  EXPECT_EQ(ask_points(false).inside, 0u) << "nobody asked for a sign";
}

TEST_P(RandomNearest, SignAgreesWithTheOracle) {
  if (GetParam().target < NearestTarget::surface) {
    const auto query = database().prepare(
        NearestQueryOptions{.name = "signed", .capacity = 1, .target = GetParam().target, .is_signed = true});
    ASSERT_FALSE(query.ok());
    EXPECT_EQ(query.error().code, ErrorCode::bad_input);
    return;
  }
  const Tally tally = ask_points(true);
  EXPECT_GT(tally.inside, tally.asked / 50) << "hardly a point inside";
}

INSTANTIATE_TEST_SUITE_P(Worlds, RandomNearest, testing::ValuesIn(cases),
                         [](const auto& one) { return std::string(one.param.name); });

/// Answers depend neither on the run, nor on the order of the batch, nor on how it is split.
class SameNearest : public DatabaseTest, public testing::WithParamInterface<NearestTarget> {
 protected:
  using Answers = std::vector<std::vector<Neighbor>>;
  NearestQueryOptions options(std::uint32_t capacity) const {
    return {.name = "nearest",
            .capacity = capacity,
            .target = GetParam(),
            .k = 6,
            .is_signed = GetParam() >= NearestTarget::surface};
  }
  Answers ask(std::span<const Nearest> points, std::uint32_t capacity) {
    auto query = database().prepare(options(capacity));
    EXPECT_TRUE(query.ok());
    Answers answers;
    for (std::size_t first = 0; first < points.size(); first += capacity) {
      const auto batch = points.subspan(first, std::min<std::size_t>(capacity, points.size() - first));
      std::ranges::copy(batch, query.value()->points().begin());
      const Outcome outcome = execute([&](Transaction& transaction) {
        transaction.add_query(*query.value(), static_cast<std::uint32_t>(batch.size()));
      });
      EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
      for (const NearestAnswer& answer : query.value()->answers())
        answers.emplace_back(answer.neighbors.begin(), answer.neighbors.end());
    }
    EXPECT_EQ(answers.size(), points.size());
    return answers;
  }
  /// The same world and points, made and asked from the beginning.
  Answers run(std::uint32_t entities) {
    open({});
    Random random(78);
    const SceneOptions scene{.radius_m = entities > 2048 ? 36.0 : 10.0, .version_time = at_s(5.0)};
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random))
      geometries.push_back(add(mesh));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < entities; ++i)
      rows.push_back(random_row(random, geometries, scene, rows));
    create(rows, scene.version_time);
    const auto states = database().snapshot({});
    points_.resize(1500);
    for (Nearest& point : points_)
      point = random_point(random, states.value(), scene, scene.version_time, 0.8);
    return ask(points_, 1500);
  }
  static bool same_bits(const Neighbor& a, const Neighbor& b) {
    const auto bits = [](const Neighbor& n) {
      return std::tuple(n.entity, n.mask, n.material, n.triangle, std::bit_cast<std::uint32_t>(n.distance_m),
                        std::bit_cast<std::uint32_t>(n.u), std::bit_cast<std::uint32_t>(n.v), n.has_sign,
                        std::bit_cast<std::array<std::uint32_t, 3>>(n.p_world_m),
                        std::bit_cast<std::array<std::uint32_t, 3>>(n.v_relative_mps));
    };
    return bits(a) == bits(b);
  }
  static std::size_t differences(const Answers& a, const Answers& b) {
    EXPECT_EQ(a.size(), b.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      count += std::ranges::equal(a[i], b[i], same_bits) ? 0 : 1;
    return count;
  }
  std::vector<Nearest> points_;
};

TEST_P(SameNearest, FromRunToRun) {
  for (const std::uint32_t entities : {200u, 2500u}) {
    const Answers first = run(entities);
    EXPECT_EQ(differences(first, run(entities)), 0u) << entities << " entities";
    EXPECT_GT(std::ranges::count(first, std::size_t{6}, &std::vector<Neighbor>::size), 500);
  }
}

TEST_P(SameNearest, WhateverTheOrder) {
  const Answers answers = run(200);
  std::vector<std::size_t> order(points_.size());
  std::iota(order.begin(), order.end(), 0);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
    std::vector<Nearest> points;
    points.reserve(order.size());
    for (const std::size_t i : order)
      points.push_back(points_[i]);
    const Answers shuffled = ask(points, 1500);
    Answers back(answers.size());
    for (std::size_t i = 0; i < order.size(); ++i)
      back[order[i]] = shuffled[i];
    EXPECT_EQ(differences(answers, back), 0u) << "seed " << seed;
  }
}

TEST_P(SameNearest, WhateverTheSplit) {
  const Answers answers = run(200);
  for (const std::uint32_t capacity : {500u, 333u, 64u, 7u})
    EXPECT_EQ(differences(answers, ask(points_, capacity)), 0u) << "batches of " << capacity;
}

TEST_P(SameNearest, AtOneInstantOrAmongOthers) {
  for (const std::uint32_t entities : {200u, 2500u}) {
    run(entities);
    for (Nearest& point : points_)
      point.t = at_s(5.4);
    const Answers alone = ask(points_, 1500);
    std::vector<Nearest> points = points_;
    points.push_back(points_[0]);
    points.back().t = at_s(5.45);
    Answers among_others = ask(points, 1501);
    among_others.pop_back();
    EXPECT_EQ(differences(alone, among_others), 0u) << entities << " entities";
  }
}

std::string name_of(const testing::TestParamInfo<NearestTarget>& target) {
  constexpr const char* names[] = {"center", "bounds", "surface", "triangle"};
  return names[static_cast<std::size_t>(target.param)];
}

INSTANTIATE_TEST_SUITE_P(Targets, SameNearest,
                         testing::Values(NearestTarget::center, NearestTarget::bounds, NearestTarget::surface,
                                         NearestTarget::triangle),
                         name_of);

/// Scanned and modelled bodies of some thousand to some hundred thousand triangles.
class NearestOnRealMeshes : public DatabaseTest, public testing::WithParamInterface<std::filesystem::path> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(NearestOnRealMeshes);
INSTANTIATE_TEST_SUITE_P(Found, NearestOnRealMeshes, testing::ValuesIn(hil::test::real_mesh_folders()),
                         [](const auto&) { return "meshes"; });

TEST_P(NearestOnRealMeshes, AgreesWithTheOracle) {
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
    const auto query = database().prepare(options);
    ASSERT_TRUE(query.ok());
    const auto points = query.value()->points();
    for (Nearest& point : points) {
      const glm::vec3 corner = mesh.value().positions_m[random.below(mesh.value().positions_m.size())];
      const auto off = static_cast<float>(random.magnitude(1e-3, 1.0)) * size_m;
      point.point_m = glm::vec3(row.scale) * corner + off * glm::vec3(random.direction());
    }
    const Outcome outcome =
        execute([&](Transaction& transaction) { transaction.add_query(*query.value(), 400); });
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    const auto answers = query.value()->answers();
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
