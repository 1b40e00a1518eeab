// Random worlds, random cones: every answer of the GPU against the oracle's.

#include <algorithm>
#include <ostream>
#include <string>

#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  RandomWorld world;
  std::size_t cones;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

constexpr Case cases[] = {
    {"one_entity", {10, 1, 0.3}, 8'000},
    {"nine", {3, 9, 2.0}, 8'000},
    {"sixty", {4, 60, 5.0}, 8'000},
    {"four_hundred", {5, 400, 14.0}, 4'000},
    {"first_large_build", {7, 2049, 30.0}, 2'000},
};

class RandomCones : public RandomQueries, public testing::WithParamInterface<Case> {};

TEST_P(RandomCones, FirstContactsAgreeWithTheOracle) {
  fill(GetParam().world);
  Tally tally = run_random(ConeQueryOptions{.name = "cones"}, GetParam().cones / 2);
  tally += run_random(ConeQueryOptions{.name = "cones", .faces = Faces::front}, GetParam().cones / 8);
  tally += run_random(ConeQueryOptions{.name = "cones", .faces = Faces::back}, GetParam().cones / 8);
  expect_informative(tally, 0.02);
}

TEST_P(RandomCones, SeveralReturnsAgreeWithTheOracle) {
  fill(GetParam().world);
  expect_informative(
      run_random(ConeQueryOptions{.name = "cones", .returns_per_cone = 8}, GetParam().cones / 4), 0.03);
}

TEST_P(RandomCones, FractionsAgreeWithTheOracle) {
  fill(GetParam().world);
  ConeQueryOptions options{.name = "cones", .returns_per_cone = 8, .fractions = true};
  expect_informative(run_random(options, GetParam().cones / 16), 0.1);
  // No geometry has a field: the same entities, and fractions by directions.
  options.mode = ConeMode::fast;
  expect_informative(run_random(options, GetParam().cones / 16), 0.2);
}

/// Answers depend neither on the run, nor on the order of the batch, nor on how it is divided.
class SameCones : public DatabaseTest, public testing::WithParamInterface<bool> {
 protected:
  static constexpr std::uint32_t count = 1000;
  std::vector<Words> run(std::span<const Cone> cones, std::uint32_t capacity) {
    auto query = database().prepare(ConeQueryOptions{
        .name = "cones", .capacity = capacity, .returns_per_cone = 3, .fractions = GetParam()});
    EXPECT_TRUE(query.ok());
    std::vector<Words> words;
    for (std::size_t first = 0; first < cones.size(); first += capacity) {
      const auto batch = cones.subspan(first, std::min<std::size_t>(capacity, cones.size() - first));
      std::ranges::copy(batch, query.value()->cones().begin());
      const Outcome outcome = execute([&](Transaction& transaction) {
        transaction.add_query(*query.value(), static_cast<std::uint32_t>(batch.size()));
      });
      EXPECT_TRUE(outcome.done()) << describe(outcome);
      for (const ConeReturn& one : query.value()->returns())
        EXPECT_NE(one.status, HitStatus::incomplete);
      const auto more = words_of(query.value()->returns());
      words.insert(words.end(), more.begin(), more.end());
    }
    return words;
  }
};

TEST_P(SameCones, WhateverTheOrderAndTheSplit) {
  Random random(78);
  const SceneOptions scene{.radius_m = 10.0, .version_time = at_s(5.0)};
  std::vector<GeometryId> geometries;
  for (const TriangleMesh& mesh : mixed_meshes(random))
    geometries.push_back(add(mesh));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < 200; ++i)
    rows.push_back(random_row(random, geometries, scene, rows));
  create(rows, scene.version_time);
  const auto states = database().snapshot({});
  std::vector<Cone> cones(count);
  for (Cone& cone : cones) {
    cone = random_cone(random, states.value(), scene, scene.version_time, 0.8);
    cone.opening_angle_rad = std::min(cone.opening_angle_rad, 0.3f);
  }
  const auto whole = run(cones, count);
  EXPECT_EQ(run(cones, count), whole);
  EXPECT_EQ(run(cones, 64), whole);
  EXPECT_EQ(run(cones, 7), whole);
  std::ranges::reverse(cones);
  const auto reversed = run(cones, 333);
  for (std::size_t i = 0; i < whole.size(); ++i)
    ASSERT_EQ(reversed[3 * (count - 1 - i / 3) + i % 3], whole[i]) << "return " << i;
}

INSTANTIATE_TEST_SUITE_P(Kinds, SameCones, testing::Bool(),
                         [](const auto& one) { return one.param ? "fractions" : "contacts"; });

INSTANTIATE_TEST_SUITE_P(Sizes, RandomCones, testing::ValuesIn(cases),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace rtstdb::test
