// Random worlds, random rays: every answer of the GPU against the oracle's.

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
  std::size_t rays;
};

std::ostream& operator<<(std::ostream& out, const Case& one) {
  return out << one.name;
}

/// 2048 is the last size that one workgroup builds alone, 2049 the first that goes the long way.
constexpr Case cases[] = {
    {"one_entity", 1, 1, 0.3, 60'000},
    {"two", 2, 2, 0.5, 60'000},
    {"nine", 3, 9, 2.0, 70'000},
    {"sixty", 4, 60, 5.0, 60'000},
    {"four_hundred", 5, 400, 14.0, 24'000},
    {"last_small_build", 6, 2048, 30.0, 8'000},
    {"first_large_build", 7, 2049, 30.0, 8'000},
    {"three_thousand", 8, 3000, 36.0, 8'000},
};

class RandomRays : public DatabaseTest, public testing::WithParamInterface<Case> {
 protected:
  static constexpr std::size_t batch = 1000;
  SceneOptions options_{.radius_m = GetParam().radius_m, .version_time = at_s(86'400.0)};
  Random random_{GetParam().seed};

  /// In three versions, with entities deleted, changed and made anew in between.
  void fill() {
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random_))
      geometries.push_back(add(mesh));
    const std::uint32_t count = GetParam().entities;
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < count; ++i)
      rows.push_back(random_row(random_, geometries, options_, rows));
    const auto ids = create(rows, at_s(1.0));
    const auto change = [&](const std::function<void(Transaction&, std::uint32_t)>& one_in_five,
                            double time_s) {
      const Outcome outcome = execute(
          [&](Transaction& transaction) {
            for (std::uint32_t i = 0; i < count; i += 5)
              one_in_five(transaction, i);
          },
          at_s(time_s));
      ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    };
    change([&](Transaction& transaction, std::uint32_t i) { transaction.remove(ids[i]); }, 2.0);
    ask_one_ray();
    change(
        [&](Transaction& transaction, std::uint32_t i) {
          transaction.create(random_row(random_, geometries, options_, rows));
          if (i + 1 < count) transaction.update(ids[i + 1], random_row(random_, geometries, options_, rows));
        },
        86'400.0);
  }
  /// So that the device has built what the next version changes.
  void ask_one_ray() { trace(ray_from({}, {1, 0, 0}, at_s(2.0))); }

  Tally ask(const oracle::World& world, RayMode mode, bool ignore_motion, std::size_t count) {
    const auto query = prepare_rays(mode, ignore_motion, batch);
    Tally tally;
    std::vector<Ray> rays(batch);
    for (std::size_t done = 0; done < count; done += batch) {
      // Windows of all lengths, from a single instant to the longest, some beginning after the version.
      const double window_s = std::min(1.0, random_.uniform(-0.2, 1.2));
      const WorldTime first = options_.version_time + Nanoseconds(random_.below(3) * 700'000'000);
      for (Ray& ray : rays)
        ray = random_ray(random_, world.entities(), options_, first, std::max(0.0, window_s));
      tally += judge(world, rays, trace(*query, rays), mode, ignore_motion);
      if (testing::Test::HasFailure()) break;
    }
    return tally;
  }
};

TEST_P(RandomRays, AgreeWithTheOracle) {
  fill();
  const oracle::World everything = world();
  ASSERT_EQ(everything.entities().size(), GetParam().entities);
  const auto share = [&](double part) {
    return static_cast<std::size_t>(part * static_cast<double>(GetParam().rays));
  };
  Tally tally = ask(everything, RayMode::closest, false, share(0.6));
  tally += ask(everything, RayMode::any, false, share(0.25));
  tally += ask(everything, RayMode::closest, true, share(0.1));
  tally += ask(everything, RayMode::any, true, share(0.05));
  EXPECT_GE(tally.asked, GetParam().rays);
  EXPECT_GT(tally.hits, tally.asked / 5) << "a world that shows little";
  EXPECT_LT(tally.hits, tally.asked * 4 / 5) << "a world that shows little";
  EXPECT_LT(tally.too_close, tally.asked / 200);
  RecordProperty("too_close", std::to_string(tally.too_close));
}

INSTANTIATE_TEST_SUITE_P(Sizes, RandomRays, testing::ValuesIn(cases),
                         [](const auto& one) { return std::string(one.param.name); });

/// Answers depend neither on the run, nor on the order of the batch, nor on how it is split.
class SameAnswers : public DatabaseTest {
 protected:
  static std::vector<RayHit> shuffled_back(const std::vector<RayHit>& hits,
                                           const std::vector<std::size_t>& order) {
    std::vector<RayHit> back(hits.size());
    for (std::size_t i = 0; i < hits.size(); ++i)
      back[order[i]] = hits[i];
    return back;
  }
  static bool same_bits(const RayHit& a, const RayHit& b) {
    const auto bits = [](const RayHit& hit) {
      return std::tuple(hit.status, std::bit_cast<std::uint32_t>(hit.lambda),
                        std::bit_cast<std::uint32_t>(hit.u), std::bit_cast<std::uint32_t>(hit.v), hit.entity,
                        hit.mask, hit.material, hit.triangle, hit.front_face,
                        std::bit_cast<std::array<std::uint32_t, 3>>(hit.n_world),
                        std::bit_cast<std::array<std::uint32_t, 3>>(hit.v_relative_mps));
    };
    return bits(a) == bits(b);
  }
  static std::size_t differences(const std::vector<RayHit>& a, const std::vector<RayHit>& b) {
    EXPECT_EQ(a.size(), b.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      count += same_bits(a[i], b[i]) ? 0 : 1;
    return count;
  }

  /// The same world and rays, made and asked from the beginning.
  std::vector<RayHit> run(std::uint32_t entities) {
    open({});
    Random random(77);
    const SceneOptions options{.radius_m = entities > 2048 ? 36.0 : 10.0, .version_time = at_s(5.0)};
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random))
      geometries.push_back(add(mesh));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < entities; ++i)
      rows.push_back(random_row(random, geometries, options, rows));
    create(rows, options.version_time);
    const auto states = database().snapshot({});
    rays_.resize(4000);
    for (Ray& ray : rays_)
      ray = random_ray(random, states.value(), options, options.version_time, 0.8);
    // The window is the batch's: one ray at either end keeps it the same whatever the split.
    return trace(rays_);
  }

  std::vector<Ray> rays_;
};

TEST_F(SameAnswers, FromRunToRun) {
  for (const std::uint32_t entities : {200u, 2500u}) {
    const auto first = run(entities);
    EXPECT_EQ(differences(first, run(entities)), 0u) << entities << " entities";
    EXPECT_GT(std::ranges::count(first, HitStatus::hit, &RayHit::status), 800);
  }
}

TEST_F(SameAnswers, WhateverTheOrder) {
  const auto hits = run(200);
  std::vector<std::size_t> order(rays_.size());
  std::iota(order.begin(), order.end(), 0);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    std::shuffle(order.begin(), order.end(), std::mt19937_64(seed));
    std::vector<Ray> rays;
    rays.reserve(order.size());
    for (const std::size_t i : order)
      rays.push_back(rays_[i]);
    EXPECT_EQ(differences(hits, shuffled_back(trace(rays), order)), 0u) << "seed " << seed;
  }
}

TEST_F(SameAnswers, WhateverTheSplit) {
  const auto hits = run(200);
  for (const std::uint32_t capacity : {1000u, 333u, 64u, 7u}) {
    const auto query = prepare_rays(RayMode::closest, false, capacity);
    EXPECT_EQ(differences(hits, trace(*query, rays_)), 0u) << "batches of " << capacity;
  }
}

}  // namespace
}  // namespace rtstdb::test
