// Rays whose searches pause and resume over many dispatches, in random worlds. A mesh of many equal triangles
// is hit like its first triangle, so the hits have the bits of those in an equal world with single triangles,
// where no search pauses.

#include <algorithm>
#include <bit>
#include <numeric>

#include "tests/gpu/dense_meshes.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t ray_count = 120;

class PausedSearches : public DatabaseTest, public testing::WithParamInterface<int> {
 protected:
  /// Moving and turning meshes and walls. `dense`: more equal triangles than a dispatch has rounds.
  void make_world(bool dense, Nanoseconds chunk = {}) {
    open({.chunk = chunk});
    Random random(static_cast<std::uint64_t>(GetParam()) + 100);
    const auto set_random_motion = [&](EntityRow& row) {
      row.motion.p_world_m = 4.0 * random.vector();
      row.motion.q_world = random.orientation();
      row.motion.v_world_mps = 0.5 * random.vector();
      row.motion.w_world_radps = random.vector();
      row.mask = 1u + static_cast<std::uint32_t>(random.below(3));
    };
    std::vector<EntityRow> rows;
    const auto meshes = 2 + random.below(4);
    for (std::size_t k = 0; k < meshes; ++k) {
      EntityRow row =
          row_of(add(repeated_triangle(dense ? 66'000 + static_cast<std::uint32_t>(k) * 5'000 : 1)), {});
      set_random_motion(row);
      row.scale = glm::dvec3(random.uniform(2.0, 12.0));
      rows.push_back(row);
    }
    const GeometryId wall = add(make_box({30.0, 30.0, 0.2}));
    for (int k = 0; k < 2; ++k) {
      EntityRow row = row_of(wall, {});
      set_random_motion(row);
      rows.push_back(row);
    }
    // From sixteen entities on there is work sharing.
    if (GetParam() % 2 == 1) rows.insert(rows.end(), 30, row_of(wall, {0.0, 900.0, 0.0}));
    std::ranges::shuffle(rows, std::mt19937(5));
    create(rows);
    make_rays(random);
  }
  /// Coherent rays around the border of octants, and random rays.
  void make_rays(Random& random) {
    rays_.clear();
    for (std::uint32_t i = 0; i < ray_count; ++i) {
      Ray ray = i < 64 ? ray_from({0.0f, 0.0f, -20.0f},
                                  {random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), 1.0})
                       : ray_from(glm::vec3(12.0 * random.vector()), glm::vec3(random.direction()));
      ray.t = at_s(i % 3 == 0 ? 0.0 : random.uniform(0.0, 0.5));
      if (i % 5 == 0) ray.mask = 1u + static_cast<std::uint32_t>(random.below(3));
      if (i % 7 == 0) ray.lambda_min = static_cast<float>(random.uniform(0.0, 20.0));
      if (i % 11 == 0) ray.lambda_max = static_cast<float>(random.uniform(20.0, 30.0));
      rays_.push_back(ray);
    }
    order_.resize(ray_count);
    std::iota(order_.begin(), order_.end(), 0u);
    std::ranges::shuffle(order_, std::mt19937(6));
  }
  std::unique_ptr<RayQuery> prepare(RayMode mode, Faces faces) {
    return DatabaseTest::prepare(
        RayQueryOptions{.name = "rays", .capacity = ray_count, .mode = mode, .faces = faces});
  }
  std::size_t count_differences(std::span<const RayHit> hits, std::span<const RayHit> expected) {
    std::size_t different = 0;
    for (std::size_t i = 0; i < expected.size(); ++i)
      different += same_bits(hits[i], expected[i]) ? 0 : 1;
    return different;
  }

  std::vector<Ray> rays_;
  std::vector<std::uint32_t> order_;
};

TEST_P(PausedSearches, HitManyEqualTrianglesLikeTheFirst) {
  struct Kind {
    RayMode mode;
    Faces faces;
  };
  constexpr Kind kinds[] = {{RayMode::closest, Faces::both}, {RayMode::closest, Faces::front},
                            {RayMode::closest, Faces::back}, {RayMode::any, Faces::both},
                            {RayMode::any, Faces::front},    {RayMode::any, Faces::back}};
  std::vector<std::vector<RayHit>> expected;
  make_world(false);
  for (const Kind kind : kinds)
    expected.push_back(trace(*prepare(kind.mode, kind.faces), rays_));
  const auto hits = std::ranges::count(expected[0], HitStatus::hit, &RayHit::status);
  EXPECT_GT(hits, ray_count / 5);
  EXPECT_LT(hits, ray_count);
  for (const Nanoseconds chunk : {Nanoseconds(0), Nanoseconds(1)}) {
    make_world(true, chunk);
    for (std::size_t k = 0; k < std::size(kinds); ++k) {
      SCOPED_TRACE(testing::Message() << "kind " << k << ", chunks of " << chunk.count() << " ns");
      const auto query = prepare(kinds[k].mode, kinds[k].faces);
      EXPECT_EQ(count_differences(trace(*query, rays_), expected[k]), 0u);
      std::vector<Ray> shuffled;
      std::vector<RayHit> expected_shuffled;
      for (const std::uint32_t i : order_) {
        shuffled.push_back(rays_[i]);
        expected_shuffled.push_back(expected[k][i]);
      }
      EXPECT_EQ(count_differences(trace(*query, shuffled), expected_shuffled), 0u) << "in another order";
      for (std::uint32_t i = 0; i < ray_count; i += 40)
        EXPECT_EQ(count_differences(trace(*query, std::span(rays_).subspan(i, 1)),
                                    std::span(expected[k]).subspan(i, 1)),
                  0u)
            << "ray " << i << " alone";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, PausedSearches, testing::Range(0, 2));

}  // namespace
}  // namespace rtstdb::test
