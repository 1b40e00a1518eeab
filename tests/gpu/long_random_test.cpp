// More than a million random elements of each query kind in many worlds, compared with the oracle, and the
// boxes of moving entities of thousands of worlds. The short forms are ray_random_test, ray_first_test,
// nearest_random_test, cone_random_test, region_random_test and motion_box_test.

#include <algorithm>
#include <ostream>
#include <string>

#include "tests/gpu/motion_box_fuzz.hpp"
#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

/// Worlds that differ by their seed.
struct Family {
  const char* name;
  std::uint64_t first_seed;
  std::uint32_t worlds;
  std::uint32_t entities;
  double radius_m;
  std::size_t per_world;  ///< elements
};

std::ostream& operator<<(std::ostream& out, const Family& family) {
  return out << family.name;
}

std::string name_of(const testing::TestParamInfo<Family>& family) {
  return family.param.name;
}

class ManyWorlds : public RandomQueries, public testing::WithParamInterface<Family> {
 protected:
  /// Number of elements of a fraction of those of a world.
  using Part = std::function<std::size_t(double)>;

  void run_worlds(const std::function<Tally(const Part&)>& run_world, double max_too_close) {
    const Family& family = GetParam();
    Tally all;
    for (std::uint64_t seed = family.first_seed; seed < family.first_seed + family.worlds; ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      open({});
      fill({.seed = seed, .entities = family.entities, .radius_m = family.radius_m});
      if (HasFailure()) return;
      all += run_world([&](double fraction) {
        return static_cast<std::size_t>(fraction * static_cast<double>(family.per_world));
      });
      if (HasFailure()) return;
    }
    EXPECT_GE(all.elements, family.worlds * family.per_world);
    expect_informative(all, max_too_close);
  }
};

class ManyRays : public ManyWorlds {};

TEST_P(ManyRays, AgreeWithTheOracle) {
  const auto options = [](RayMode mode, std::uint32_t hits_per_ray, Faces faces, bool ignore_motion) {
    return RayQueryOptions{.name = "rays",
                           .mode = mode,
                           .hits_per_ray = hits_per_ray,
                           .faces = faces,
                           .ignore_motion = ignore_motion};
  };
  run_worlds(
      [&](const Part& part) {
        Tally tally = run_random(options(RayMode::closest, 1, Faces::both, false), part(0.25));
        tally += run_neighbours(options(RayMode::closest, 1, Faces::both, false), part(0.15));
        tally += run_random(options(RayMode::closest, 1, Faces::both, true), part(0.025));
        tally += run_neighbours(options(RayMode::closest, 1, Faces::both, true), part(0.025));
        tally += run_random(options(RayMode::closest, 1, Faces::front, false), part(0.05));
        tally += run_neighbours(options(RayMode::closest, 1, Faces::front, false), part(0.05));
        tally += run_random(options(RayMode::closest, 1, Faces::back, false), part(0.05));
        tally += run_random(options(RayMode::any, 1, Faces::both, false), part(0.1));
        tally += run_neighbours(options(RayMode::any, 1, Faces::both, false), part(0.1));
        tally += run_random(options(RayMode::any, 1, Faces::both, true), part(0.025));
        tally += run_neighbours(options(RayMode::any, 1, Faces::both, true), part(0.025));
        tally += run_random(options(RayMode::first, 4, Faces::both, false), part(0.1));
        tally += run_random(options(RayMode::first, 16, Faces::both, false), part(0.03));
        tally += run_random(options(RayMode::first, 3, Faces::back, true), part(0.02));
        return tally;
      },
      0.001);
}

INSTANTIATE_TEST_SUITE_P(Families, ManyRays,
                         testing::Values(Family{"one", 1000, 20, 1, 0.3, 10'000},
                                         Family{"nine", 1100, 20, 9, 2.0, 15'000},
                                         Family{"sixty", 1200, 20, 60, 5.0, 20'000},
                                         Family{"four_hundred", 1300, 12, 400, 14.0, 10'000},
                                         Family{"three_thousand", 1400, 6, 3000, 36.0, 10'000}),
                         name_of);

class ManyPoints : public ManyWorlds {};

TEST_P(ManyPoints, AgreeWithTheOracle) {
  run_worlds(
      [&](const Part& part) {
        Tally tally;
        for (const NearestTarget target : {NearestTarget::center, NearestTarget::bounds,
                                           NearestTarget::surface, NearestTarget::triangle}) {
          // Different kernels keep lists of 1, of up to 8 and of up to 32.
          const bool of_entities = target != NearestTarget::triangle;
          const std::uint32_t max_k =
              of_entities ? std::min(max_neighbors, GetParam().entities) : max_neighbors;
          for (const std::uint32_t longest : {1u, std::min(8u, max_k), max_k}) {
            const NearestQueryOptions options{
                .name = "points",
                .target = target,
                .k = 1 + static_cast<std::uint32_t>(random().below(longest)),
                .is_signed = target >= NearestTarget::surface && random().one_in(2)};
            tally += run_random(options, part(1.0 / 12.0));
          }
        }
        return tally;
      },
      0.02);
}

INSTANTIATE_TEST_SUITE_P(Families, ManyPoints,
                         testing::Values(Family{"one", 2000, 20, 1, 2.0, 12'000},
                                         Family{"nine", 2100, 20, 9, 3.0, 18'000},
                                         Family{"sixty", 2200, 20, 60, 5.0, 18'000},
                                         Family{"six_hundred", 2300, 10, 600, 16.0, 6'000},
                                         Family{"three_thousand", 2400, 4, 3000, 36.0, 6'000}),
                         name_of);

class ManyCones : public ManyWorlds {};

TEST_P(ManyCones, AgreeWithTheOracle) {
  run_worlds(
      [&](const Part& part) {
        Tally tally = run_random(ConeQueryOptions{.name = "cones"}, part(0.6));
        tally += run_random(ConeQueryOptions{.name = "cones", .faces = Faces::front}, part(0.1));
        tally += run_random(ConeQueryOptions{.name = "cones", .faces = Faces::back}, part(0.1));
        tally += run_random(ConeQueryOptions{.name = "cones", .returns_per_cone = 8}, part(0.18));
        tally += run_random(ConeQueryOptions{.name = "cones", .returns_per_cone = 8, .fractions = true},
                            part(0.02));
        return tally;
      },
      0.005);
}

INSTANTIATE_TEST_SUITE_P(Families, ManyCones,
                         testing::Values(Family{"one", 2500, 20, 1, 0.3, 15'000},
                                         Family{"nine", 2600, 20, 9, 2.0, 15'000},
                                         Family{"sixty", 2700, 20, 60, 5.0, 17'500},
                                         Family{"four_hundred", 2800, 10, 400, 14.0, 8'000},
                                         Family{"large_build", 2900, 4, 2049, 30.0, 3'000}),
                         name_of);

class ManyRegions : public ManyWorlds {};

TEST_P(ManyRegions, AgreeWithTheOracle) {
  run_worlds(
      [&](const Part& part) {
        Tally tally = run_random(RegionQueryOptions{.name = "regions", .ids_per_region = 4096}, part(0.6));
        tally += run_random(RegionQueryOptions{.name = "regions", .ids_per_region = 5}, part(0.2));
        tally += run_random(RegionQueryOptions{.name = "regions", .ids_per_region = 0}, part(0.2));
        return tally;
      },
      0.001);
}

INSTANTIATE_TEST_SUITE_P(Families, ManyRegions,
                         testing::Values(Family{"one", 3000, 20, 1, 0.5, 15'000},
                                         Family{"nine", 3100, 20, 9, 2.0, 20'000},
                                         Family{"forty", 3200, 20, 40, 4.0, 15'000},
                                         Family{"six_hundred", 3300, 10, 600, 12.0, 4'000},
                                         Family{"large_build", 3400, 5, 2500, 20.0, 3'000}),
                         name_of);

class ManyOverlaps : public ManyWorlds {};

TEST_P(ManyOverlaps, AgreeWithTheOracle) {
  run_worlds(
      [&](const Part& part) {
        Tally tally = run_random(OverlapQueryOptions{.name = "overlaps", .ids_per_entity = 4096}, part(0.6));
        tally += run_random(OverlapQueryOptions{.name = "overlaps", .ids_per_entity = 2}, part(0.2));
        tally += run_random(OverlapQueryOptions{.name = "overlaps", .ids_per_entity = 0}, part(0.2));
        return tally;
      },
      0.001);
}

INSTANTIATE_TEST_SUITE_P(Families, ManyOverlaps,
                         testing::Values(Family{"nine", 4100, 10, 9, 1.5, 10'000},
                                         Family{"forty", 4200, 10, 40, 4.0, 10'000},
                                         Family{"six_hundred", 4300, 5, 600, 12.0, 2'000}),
                         name_of);

TEST_F(MotionBoxFuzz, FindsNothingOutsideOfItsBoxInThousandsOfWorlds) {
  for (std::uint64_t seed = 1'000; seed < 11'000 && !HasFailure(); ++seed)
    fuzz(seed);
  EXPECT_GT(counts().refits, 5'000u);
  RecordProperty("points", std::to_string(points()));
}

}  // namespace
}  // namespace rtstdb::test
