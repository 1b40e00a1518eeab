// Random first times of impact of surfaces and of hulls, of sizes from equal to 1 to 100, that fly at, turn
// beside and lie in one another: every answer against the oracle, and the share of undecided ones.

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "rtstdb/oracle/surface_approach.hpp"
#include "tests/gpu/deforming_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/concave_meshes.hpp"
#include "tests/support/hull_meshes.hpp"
#include "tests/support/parallel.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

/// Triangles and needles within a ball of 1 m, which are connected to nothing.
TriangleMesh make_soup(Random& random, std::uint32_t count) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::dvec3 center_m = random.uniform(0.0, 0.7) * random.direction();
    const glm::dvec3 along = random.magnitude(0.02, 0.3) * random.direction();
    const glm::dvec3 across = random.magnitude(0.002, 0.3) * random.direction();
    for (const glm::dvec3& corner : {center_m - along, center_m + along, center_m + across})
      mesh.positions_m.emplace_back(corner);
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

/// Bodies of about 1 m that are not convex.
std::vector<TriangleMesh> surface_meshes(Random& random) {
  return {make_torus(0.7, 0.25, 12),         make_bowl(1.0, 0.85, 16),    make_hollow_sphere(1.0, 0.8, 1),
          make_gear(1.0, 0.75, 0.4, 0.4, 9), make_l_shape(1.0, 0.3, 0.5), make_fingers(3, 0.15, 1.2, 0.5, 8),
          make_wavy_sheet(1.6, 0.2, 9),      make_soup(random, 60),       make_wavy_sheet(1.6, 0.01, 4)};
}

/// How the second body of a pair moves relative to the first one.
enum class Encounter : std::uint8_t {
  flies_at,  ///< from some diameters away, with a random miss
  turns_beside,
  is_within,  ///< begins within the bounds of the first one, slowly
};

class RandomSurfaceImpacts : public DeformingGeometry {
 protected:
  /// Counts of the searches that were judged.
  struct Counts {
    std::size_t searches = 0, impacts = 0, none = 0, undecided = 0;
    std::size_t close = 0;            ///< they pass within two tolerances without impact
    std::size_t close_undecided = 0;  ///< the undecided of these
    std::array<std::size_t, 4> by_reason{};
  };

  /// A pair of which the larger body is `ratio` times as large as the smaller one. Geometries are of about
  /// 1 m.
  static std::array<EntityRow, 2> random_pair(Random& random, GeometryId first, GeometryId second,
                                              double max_ratio) {
    const double ratio = random.magnitude(1.0, max_ratio);
    const double size_m = random.magnitude(0.3, 3.0);
    std::array<EntityRow, 2> rows{row_of(first, 100.0 * random.vector()), row_of(second)};
    if (random.one_in(2)) std::swap(rows[0].geometry, rows[1].geometry);
    rows[0].scale = size_m * ratio * glm::dvec3(1.0, random.magnitude(0.7, 1.4), random.magnitude(0.7, 1.4));
    rows[1].scale = size_m * glm::dvec3(1.0, random.magnitude(0.7, 1.4), random.magnitude(0.7, 1.4));
    const double larger_m = size_m * ratio;
    const double both_m = larger_m + size_m;
    const glm::dvec3 side = random.direction();
    const auto encounter = static_cast<Encounter>(random.below(3));
    const double w_radps = random.one_in(4) ? 0.0 : random.magnitude(0.01, 10.0);
    for (EntityRow& row : rows) {
      row.motion.q_world = random.orientation();
      row.motion.w_world_radps = w_radps * random.uniform(0.0, 1.0) * random.direction();
    }
    glm::dvec3 v_mps(0.0);
    double apart_m = 0.0;
    switch (encounter) {
      case Encounter::flies_at:
        apart_m = random.magnitude(1.5, 20.0) * both_m;
        v_mps = -random.magnitude(0.2, 20.0) * both_m *
                glm::normalize(side + 0.4 * (larger_m / apart_m) * random.vector());
        break;
      case Encounter::turns_beside:
        apart_m = random.uniform(1.0, 1.6) * both_m;
        v_mps = random.magnitude(0.001, 0.2) * both_m * random.direction();
        break;
      case Encounter::is_within:
        apart_m = random.uniform(0.0, 1.0) * larger_m;
        v_mps = random.magnitude(0.001, 1.0) * both_m * random.direction();
        break;
    }
    rows[1].motion.p_world_m = rows[0].motion.p_world_m + apart_m * side;
    rows[0].motion.v_world_mps = random.vector();
    rows[1].motion.v_world_mps = rows[0].motion.v_world_mps + v_mps;
    return rows;
  }

  /// A search of a body and a smaller one, in random order.
  static ImpactSearch random_search(Random& random, EntityId larger, EntityId smaller, double smaller_m) {
    const bool larger_is_first = random.one_in(2);
    return {.first = larger_is_first ? larger : smaller,
            .second = larger_is_first ? smaller : larger,
            .window = Nanoseconds(static_cast<std::int64_t>(1e9 * random.magnitude(0.1, 10.0))),
            .tolerance_m = static_cast<float>(smaller_m * random.magnitude(0.001, 0.02))};
  }

  /// Runs the searches as one batch, judges the answers and counts them.
  void run_and_judge(std::span<const ImpactSearch> searches, Counts& counts) {
    const auto count = static_cast<std::uint32_t>(searches.size());
    const ImpactQueryOptions options{.name = "random", .capacity = count, .candidates_per_search = 16};
    const auto query = prepare(options);
    ASSERT_NE(query, nullptr);
    std::ranges::copy(searches, query->searches().begin());
    const Outcome outcome = run(*query, count);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    const oracle::World world = this->world();
    judge(world, searches, query->answers(), options);
    std::vector<char> is_close(count);
    for_each_in_parallel(count, [&](std::size_t i) {
      if (query->answers()[i].status != ImpactStatus::impact) is_close[i] = passes_close(world, searches[i]);
    });
    for (std::uint32_t i = 0; i < count; ++i) {
      const ImpactAnswer& answer = query->answers()[i];
      const bool is_undecided = answer.status == ImpactStatus::undecided;
      ++counts.searches;
      counts.impacts += answer.status == ImpactStatus::impact ? 1 : 0;
      counts.none += answer.status == ImpactStatus::none ? 1 : 0;
      counts.close += is_close[i] != 0 ? 1 : 0;
      counts.undecided += is_undecided && is_close[i] == 0 ? 1 : 0;
      counts.close_undecided += is_undecided && is_close[i] != 0 ? 1 : 0;
      ++counts.by_reason[static_cast<std::size_t>(answer.reason)];
    }
  }

  /// Within two tolerances in the window, and never within one.
  static bool passes_close(const oracle::World& world, const ImpactSearch& search) {
    const double window_s = static_cast<double>(search.window.count()) * 1e-9;
    const auto tolerance_m = static_cast<double>(search.tolerance_m);
    return oracle::time_nearer_than(world, search, search.second, 2.0 * tolerance_m, window_s) &&
           !oracle::time_nearer_than(world, search, search.second, tolerance_m, window_s);
  }

  static void expect_decided(const Counts& counts) {
    const std::string all = std::to_string(counts.searches) + " searches: " + std::to_string(counts.impacts) +
                            " impacts, " + std::to_string(counts.none) + " without, " +
                            std::to_string(counts.undecided) + " undecided, " + std::to_string(counts.close) +
                            " pass closely, " + std::to_string(counts.close_undecided) +
                            " of these undecided; undecided by steps " + std::to_string(counts.by_reason[1]) +
                            ", by distance " + std::to_string(counts.by_reason[2]);
    RecordProperty("counts", all);
    SCOPED_TRACE(all);
    EXPECT_LT(1000 * counts.undecided, counts.searches);
    EXPECT_LT(50 * counts.close, counts.searches);
    EXPECT_GT(5 * counts.impacts, counts.searches);
    EXPECT_GT(10 * counts.none, counts.searches);
    EXPECT_EQ(counts.by_reason[static_cast<std::size_t>(UndecidedReason::capacity)], 0u);
  }
};

TEST_F(RandomSurfaceImpacts, AreDecidedAndAgreeWithTheOracle) {
  constexpr std::uint32_t pairs = 600;
  const std::uint64_t batches = hil::tests::rounds(8, 100);
  Counts counts;
  for (std::uint64_t round = 0; round < batches && !HasFailure(); ++round) {
    SCOPED_TRACE(testing::Message() << "round " << round);
    open({.max_entities = 2 * pairs});
    Random random(4'700 + round);
    std::vector<GeometryId> surfaces;
    for (const TriangleMesh& mesh : surface_meshes(random))
      surfaces.push_back(add(mesh));
    // A sheet and a ring that have changed their shapes.
    for (const TriangleMesh& mesh : {make_wavy_sheet(1.6, 0.2, 9), make_torus(0.7, 0.25, 12)}) {
      surfaces.push_back(add_deforming(mesh));
      committed(surfaces.back(), scaled(mesh, {random.uniform(0.6, 1.2), 1.0, random.uniform(0.6, 2.0)}));
    }
    std::vector<GeometryId> all = surfaces;
    all.push_back(add(make_box({0.9, 0.7, 0.5})));
    all.push_back(add(make_random_hull(round, 24, {0.9, 0.6, 0.4})));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < pairs; ++i) {
      const auto pair =
          random_pair(random, surfaces[random.below(surfaces.size())], all[random.below(all.size())], 100.0);
      rows.insert(rows.end(), pair.begin(), pair.end());
    }
    const std::vector<EntityId> bodies = create(rows);
    std::vector<ImpactSearch> searches;
    for (std::uint32_t i = 0; i < pairs; ++i)
      searches.push_back(random_search(random, bodies[2 * i], bodies[2 * i + 1], rows[2 * i + 1].scale.x));
    run_and_judge(searches, counts);
  }
  expect_decided(counts);
}

TEST_F(RandomSurfaceImpacts, OfHullsAreDecidedAndAgreeWithTheOracle) {
  constexpr std::uint32_t pairs = 600;
  const std::uint64_t batches = hil::tests::rounds(8, 100);
  Counts counts;
  for (std::uint64_t round = 0; round < batches && !HasFailure(); ++round) {
    SCOPED_TRACE(testing::Message() << "round " << round);
    open({.max_entities = 2 * pairs});
    Random random(5'700 + round);
    std::vector<GeometryId> hulls{add(make_box({0.9, 0.7, 0.5})), add(make_box({1.0, 0.05, 0.05})),
                                  add(make_box({1.0, 1.0, 0.02}))};
    for (std::uint64_t i = 0; i < 12; ++i)
      hulls.push_back(add(make_random_hull(100 * round + i, 6 + static_cast<std::uint32_t>(random.below(30)),
                                           {0.3 + 0.7 * random.uniform(0.0, 1.0), 0.6, 0.9})));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < pairs; ++i) {
      const auto pair =
          random_pair(random, hulls[random.below(hulls.size())], hulls[random.below(hulls.size())], 100.0);
      rows.insert(rows.end(), pair.begin(), pair.end());
    }
    const std::vector<EntityId> bodies = create(rows);
    std::vector<ImpactSearch> searches;
    for (std::uint32_t i = 0; i < pairs; ++i)
      searches.push_back(random_search(random, bodies[2 * i], bodies[2 * i + 1], rows[2 * i + 1].scale.x));
    run_and_judge(searches, counts);
  }
  expect_decided(counts);
}

}  // namespace
}  // namespace rtstdb::test
