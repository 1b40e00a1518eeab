// Random contacts: every answer of the GPU against the oracle's.

#include <algorithm>
#include <ostream>

#include "tests/gpu/random_queries.hpp"
#include "tests/support/hull_meshes.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  RandomWorld world;
  std::size_t searches;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

constexpr Case cases[] = {
    {"nine", {3, 9, 0.7}, 900},
    {"sixty", {4, 60, 1.5}, 400},
    {"four_hundred", {5, 400, 4.0}, 150},
};

class RandomContacts : public RandomQueries, public testing::WithParamInterface<Case> {};

TEST_P(RandomContacts, AgreeWithTheOracle) {
  fill(GetParam().world);
  ContactQueryOptions options{.name = "contacts",
                              .pairs_per_search = 512,
                              .max_candidates = 65536,
                              .max_surface_triangles = 1u << 20};
  Tally tally = run_random(options, GetParam().searches);
  options.pairs_per_search = 2;
  tally += run_random(options, GetParam().searches / 3);
  // Most pairs of these worlds have a body that is not convex.
  EXPECT_GT(tally.hits, tally.elements / 40);
  EXPECT_LE(tally.too_close, tally.elements / 20);
}

INSTANTIATE_TEST_SUITE_P(Worlds, RandomContacts, testing::ValuesIn(cases),
                         [](const auto& of_case) { return std::string(of_case.param.name); });

struct HullCase {
  const char* name;
  std::uint32_t min_corners, max_corners;
  std::size_t pairs;
};

std::ostream& operator<<(std::ostream& out, const HullCase& test_case) {
  return out << test_case.name;
}

class RandomHulls : public DatabaseTest, public testing::WithParamInterface<HullCase> {
 protected:
  static constexpr std::uint32_t pairs_per_batch = 2000;

  /// Pairs of hulls, each pair far from the others; about half of them touch.
  std::vector<ContactSearch> make_pairs(Random& random) {
    std::vector<EntityRow> rows;
    const auto random_body = [&](const glm::dvec3& p_m) {
      EntityRow row = row_of(hulls_[random.below(hulls_.size())], p_m);
      row.scale =
          glm::dvec3(random.magnitude(0.3, 3.0), random.magnitude(0.3, 3.0), random.magnitude(0.3, 3.0));
      row.motion.q_world = random.orientation();
      row.motion.v_world_mps = random.vector();
      row.motion.w_world_radps = random.vector();
      return row;
    };
    for (std::uint32_t i = 0; i < pairs_per_batch; ++i) {
      const glm::dvec3 p_m(100u * glm::uvec3(i % 50, i / 50, 10));
      const EntityRow first = random_body(p_m);
      EntityRow second = random_body(p_m);
      const double reach_m = 0.5 * (glm::length(first.scale) + glm::length(second.scale));
      second.motion.p_world_m += random.uniform(0.0, 1.8) * reach_m * random.direction();
      rows.insert(rows.end(), {first, second});
    }
    const std::vector<EntityId> entities = create(rows);
    std::vector<ContactSearch> searches;
    for (std::uint32_t i = 0; i < pairs_per_batch; ++i) {
      ContactSearch& search = searches.emplace_back();
      search.first = entities[2 * i];
      search.second = entities[2 * i + 1];
      if (random.one_in(4)) search.margin_m = static_cast<float>(random.magnitude(0.01, 1.0));
    }
    return searches;
  }

  std::vector<GeometryId> hulls_;
};

TEST_P(RandomHulls, AgreeWithTheOracle) {
  const HullCase& hulls = GetParam();
  const std::size_t batches =
      std::max<std::size_t>(1, hulls.pairs * hil::tests::rounds(1, 100) / pairs_per_batch);
  Tally tally;
  for (std::size_t batch = 0; batch < batches && !HasFailure(); ++batch) {
    open({.max_entities = 2 * pairs_per_batch});
    Random random(71 + batch);
    hulls_.clear();
    for (int i = 0; i < 40; ++i) {
      const auto corners = hulls.min_corners + static_cast<std::uint32_t>(
                                                   random.below(hulls.max_corners - hulls.min_corners + 1));
      hulls_.push_back(add(
          make_random_hull(1000 * batch + i, corners,
                           {random.uniform(0.2, 1.0), random.uniform(0.2, 1.0), random.uniform(0.2, 1.0)})));
    }
    const std::vector<ContactSearch> searches = make_pairs(random);
    const ContactQueryOptions options{
        .name = "hulls", .capacity = pairs_per_batch, .pairs_per_search = 1, .max_bodies = 1};
    const auto query = prepare(options);
    ASSERT_NE(query, nullptr);
    std::ranges::copy(searches, query->searches().begin());
    const Outcome outcome = run(*query, searches.size());
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    tally += judge(world(), searches, query->answers(), options);
    const auto undecided = std::ranges::count_if(query->answers(), [](const ContactAnswer& answer) {
      return answer.pairs[0].status == PairStatus::undecided;
    });
    EXPECT_LE(undecided, pairs_per_batch / 200);
  }
  expect_informative(tally, 0.02);
}

/// Bodies of two to four hulls, close to one another.
class RandomParts : public RandomHulls {
 protected:
  TriangleMesh parts(Random& random, std::uint64_t seed) {
    TriangleMesh mesh;
    const std::size_t count = 2 + random.below(3);
    for (std::size_t part = 0; part < count; ++part) {
      const TriangleMesh hull =
          make_random_hull(10 * seed + part, 8 + static_cast<std::uint32_t>(random.below(8)),
                           {random.uniform(0.2, 0.6), random.uniform(0.2, 0.6), random.uniform(0.2, 0.6)});
      const glm::vec3 at_m(0.6 * random.vector());
      const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
      for (const glm::vec3& p : hull.positions_m)
        mesh.positions_m.push_back(p + at_m);
      for (const glm::uvec3& triangle : hull.triangles)
        mesh.triangles.push_back(triangle + first);
    }
    return mesh;
  }
};

TEST_P(RandomParts, AgreeWithTheOracle) {
  Tally tally;
  for (std::uint64_t batch = 0; batch < hil::tests::rounds(1, 20) && !HasFailure(); ++batch) {
    open({.max_entities = 2 * pairs_per_batch});
    Random random(7 + batch);
    hulls_.clear();
    for (std::uint64_t i = 0; i < 20; ++i)
      hulls_.push_back(add(parts(random, 100 * batch + i)));
    const std::vector<ContactSearch> searches = make_pairs(random);
    const ContactQueryOptions options{.name = "parts",
                                      .capacity = pairs_per_batch,
                                      .pairs_per_search = 1,
                                      .max_candidates = 16 * pairs_per_batch,
                                      .max_bodies = 1};
    const auto query = prepare(options);
    ASSERT_NE(query, nullptr);
    std::ranges::copy(searches, query->searches().begin());
    const Outcome outcome = run(*query, searches.size());
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    tally += judge(world(), searches, query->answers(), options);
  }
  EXPECT_GT(tally.hits, tally.elements / 10);
  EXPECT_LE(tally.too_close, tally.elements / 30);
}

INSTANTIATE_TEST_SUITE_P(Corners, RandomParts, testing::Values(HullCase{"of_8_to_16_corners", 8, 16, 2000}),
                         [](const auto& of_case) { return std::string(of_case.param.name); });

constexpr HullCase hull_cases[] = {
    {"of_8_to_32_corners", 8, 32, 10'000},
    {"of_100_corners", 100, 100, 2'000},
};

INSTANTIATE_TEST_SUITE_P(Corners, RandomHulls, testing::ValuesIn(hull_cases),
                         [](const auto& of_case) { return std::string(of_case.param.name); });

}  // namespace
}  // namespace rtstdb::test
