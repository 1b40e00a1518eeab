// Random worlds, random rays: every answer of the GPU against the oracle's.

#include <algorithm>
#include <numeric>
#include <ostream>
#include <string>

#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/random_questions.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  RandomWorld world;
  std::size_t rays;
};

std::ostream& operator<<(std::ostream& out, const Case& one) {
  return out << one.name;
}

/// 2048 is the last size that one workgroup builds alone, 2049 the first that goes the long way.
constexpr Case cases[] = {
    {"one_entity", {10, 1, 0.3}, 60'000},
    {"two", {6, 2, 0.5}, 60'000},
    {"nine", {3, 9, 2.0}, 70'000},
    {"sixty", {4, 60, 5.0}, 60'000},
    {"four_hundred", {5, 400, 14.0}, 24'000},
    {"last_small_build", {6, 2048, 30.0}, 8'000},
    {"first_large_build", {7, 2049, 30.0}, 8'000},
    {"three_thousand", {8, 3000, 36.0}, 8'000},
};

class RandomRays : public RandomQuestions, public testing::WithParamInterface<Case> {
 protected:
  /// Of every kind that has a kernel of its own.
  Tally ask_all_kinds(std::size_t rays) {
    const auto share = [&](double part) {
      return static_cast<std::size_t>(part * static_cast<double>(rays));
    };
    Tally tally = ask(RayQueryOptions{.name = "rays"}, share(0.6));
    tally += ask(RayQueryOptions{.name = "rays", .mode = RayMode::any}, share(0.25));
    tally += ask(RayQueryOptions{.name = "rays", .ignore_motion = true}, share(0.1));
    tally += ask(RayQueryOptions{.name = "rays", .mode = RayMode::any, .ignore_motion = true}, share(0.05));
    return tally;
  }
};

TEST_P(RandomRays, AgreeWithTheOracle) {
  fill(GetParam().world);
  expect_telling(ask_all_kinds(GetParam().rays), 0.005);
}

/// As on a device whose lanes do not work together.
TEST_P(RandomRays, OfLoneLanesAgreeWithTheOracle) {
  open({}, {.use_subgroup_kernels = false});
  fill(GetParam().world);
  expect_telling(ask_all_kinds(GetParam().rays / 4), 0.005);
}

TEST_P(RandomRays, OfOneSideAgreeWithTheOracle) {
  fill(GetParam().world);
  Tally tally = ask(RayQueryOptions{.name = "rays", .faces = Faces::front}, GetParam().rays / 20);
  tally += ask(RayQueryOptions{.name = "rays", .faces = Faces::back}, GetParam().rays / 20);
  expect_telling(tally, 0.005);
}

TEST_P(RandomRays, SideBySideAgreeWithTheOracle) {
  fill(GetParam().world);
  const std::size_t some = GetParam().rays / 10;
  Tally tally = ask_neighbours(RayQueryOptions{.name = "rays"}, 4 * some);
  tally += ask_neighbours(RayQueryOptions{.name = "rays", .mode = RayMode::any}, 2 * some);
  tally += ask_neighbours(RayQueryOptions{.name = "rays", .ignore_motion = true}, 2 * some);
  tally += ask_neighbours(RayQueryOptions{.name = "rays", .mode = RayMode::any, .ignore_motion = true}, some);
  tally += ask_neighbours(RayQueryOptions{.name = "rays", .faces = Faces::back}, some);
  expect_telling(tally, 0.005);
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
  static std::size_t differences(const std::vector<RayHit>& a, const std::vector<RayHit>& b) {
    EXPECT_EQ(a.size(), b.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      count += same_bits(a[i], b[i]) ? 0 : 1;
    return count;
  }

  /// The same world and rays, made and asked from the beginning.
  std::vector<RayHit> run(std::uint32_t entities) {
    make(entities, [](auto&&... scene) { return std::vector{random_ray(scene...)}; });
    return trace(rays_);
  }

  /// Four thousand rays, as many at a time as `some_rays` makes.
  template <class SomeRays>
  void make(std::uint32_t entities, SomeRays some_rays, const gpu::DeviceOptions& device = {}) {
    open({}, device);
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
    rays_.clear();
    while (rays_.size() < 4000) {
      const auto some = some_rays(random, states.value(), options, options.version_time, 0.8);
      rays_.insert(rays_.end(), some.begin(), some.end());
    }
  }

  /// Asked by each kind of kernel: at an instant or over the window, for the nearest hits or for any.
  std::vector<std::vector<RayHit>> trace_as_each_kind(std::span<const Ray> rays) {
    std::vector<std::vector<RayHit>> hits;
    for (const bool ignore_motion : {false, true}) {
      for (const RayMode mode : {RayMode::closest, RayMode::any})
        hits.push_back(trace(*prepare_rays(mode, ignore_motion), rays));
    }
    return hits;
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

/// Neighbours that run side by side are traced together; others, and all where lanes do not work together, by
/// a lane each.
TEST_F(SameAnswers, WhoeverRunsBeside) {
  for (const std::uint32_t entities : {1u, 200u, 2500u}) {
    const auto neighbours = [](auto&&... scene) { return random_neighbours(scene...); };
    make(entities, neighbours);
    std::vector<std::size_t> order(rays_.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [](std::size_t i) { return i % 8; });
    std::vector<Ray> apart;
    apart.reserve(order.size());
    for (const std::size_t i : order)
      apart.push_back(rays_[i]);
    ASSERT_TRUE(query::are_coherent(rays_));
    ASSERT_FALSE(query::are_coherent(apart));
    const auto beside = trace_as_each_kind(rays_);
    const auto by_lanes = trace_as_each_kind(apart);
    make(entities, neighbours, {.use_subgroup_kernels = false});
    const auto alone = trace_as_each_kind(rays_);
    for (std::size_t kind = 0; kind < beside.size(); ++kind) {
      EXPECT_EQ(differences(beside[kind], shuffled_back(by_lanes[kind], order)), 0u)
          << entities << " entities, kind " << kind << ", by a lane each";
      EXPECT_EQ(differences(beside[kind], alone[kind]), 0u)
          << entities << " entities, kind " << kind << ", where lanes do not work together";
      EXPECT_GT(std::ranges::count(beside[kind], HitStatus::hit, &RayHit::status), 250);
      EXPECT_GT(std::ranges::count(beside[kind], HitStatus::miss, &RayHit::status), 250);
    }
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
