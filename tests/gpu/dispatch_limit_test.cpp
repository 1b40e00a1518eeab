// Batches of rays with more groups than a device allows in one dispatch are split into several dispatches,
// with the same answers. All other dispatches have no more groups than Vulkan guarantees.

#include <algorithm>
#include <limits>
#include <vector>

#include "tests/gpu/answer_bits.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/fault_loader.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

class DispatchLimit : public DatabaseTest {
 protected:
  static constexpr std::uint32_t ray_count = 1000;  // 16 groups

  /// The answers on a device that allows so many groups in a dispatch (0: its own limit), in as many chunks
  /// as there can be. Equal calls give equal worlds and rays.
  std::vector<Words> answers_with(std::uint32_t max_groups, bool coherent) {
    loader_.allow_groups(max_groups);
    open({.max_entities = 64, .chunk = Nanoseconds(1)}, {.loader_library = FAULT_LOADER});
    Random random(7);
    const SceneOptions scene;
    const std::vector geometries = {add(make_box({1.0, 2.0, 3.0})), add(make_sphere(1.5, 1))};
    std::vector<EntityRow> rows;
    for (int i = 0; i < 50; ++i)
      rows.push_back(random_row(random, geometries, scene, {}));
    create(rows);
    const auto entities = database().snapshot({}).value();
    const auto query = prepare_rays(RayMode::closest, false, ray_count);
    const std::span<Ray> rays = query->rays();
    fill_with_neighbours(rays, random, entities, scene, {}, 0.5);
    for (std::size_t i = 0; i < rays.size() && !coherent; ++i)
      if (i % 8 != 0) rays[i] = random_ray(random, entities, scene, {}, 0.5);
    // After the first run the cost of a ray is known, and with it the size of a chunk.
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t before = loader_.groups();
      EXPECT_TRUE(run(*query, ray_count).done());
      groups_ = loader_.groups() - before;
    }
    return words_of(query->hits());
  }

  gpu::test::FaultLoader loader_;
  std::uint64_t groups_ = 0;  ///< of the last run
};

TEST_F(DispatchLimit, OfFewGroupsChangesNoAnswer) {
  for (const bool coherent : {false, true}) {
    const auto expected = answers_with(0, coherent);
    ASSERT_EQ(expected.size(), ray_count);
    EXPECT_GT(std::ranges::count_if(
                  expected,
                  [](const Words& words) { return words[0] == static_cast<std::uint32_t>(HitStatus::hit); }),
              200);
    for (const std::uint32_t max_groups : {15u, 8u, 5u})
      EXPECT_TRUE(answers_with(max_groups, coherent) == expected)
          << max_groups << " groups in a dispatch, coherent " << coherent;
  }
}

/// The first group of a second dispatch would exceed 32 bits.
TEST_F(DispatchLimit, OfTheLargestNumberGivesOneDispatch) {
  const auto expected = answers_with(0, false);
  const std::uint64_t groups = groups_;
  EXPECT_GE(groups, ray_count / 64);
  EXPECT_TRUE(answers_with(std::numeric_limits<std::uint32_t>::max(), false) == expected);
  EXPECT_LT(groups_, 2 * groups) << "some groups ran twice";
}

}  // namespace
}  // namespace rtstdb::test
