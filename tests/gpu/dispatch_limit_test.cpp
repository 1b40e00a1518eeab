// Batches of rays of more groups than a device takes in one dispatch: they go in pieces, and the answers are
// the same. Every other dispatch keeps to what Vulkan guarantees.

#include <bit>
#include <cstdlib>
#include <limits>

#include "rtstdb/open_database.hpp"
#include "tests/gpu/database_test.hpp"
#include "tests/gpu/fault_loader.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

struct Answer {
  HitStatus status = HitStatus::incomplete;
  EntityId entity;
  std::uint32_t lambda_bits = 0;

  bool operator==(const Answer&) const = default;
};

class DispatchLimit : public testing::Test {
 protected:
  static constexpr std::uint32_t rays = 1000;  // 16 groups

  /// The same world and the same rays each time; what is built for them goes into few groups.
  std::vector<Answer> ask_with(std::uint32_t groups, bool side_by_side) {
    loader_.allow_groups(groups);
    DatabaseOptions options;
    options.max_entities = 64;
    options.validation = Validation::on;
    options.chunk = Nanoseconds(1);  // as many chunks as there can be
    if (const char* select = std::getenv("HIL_TEST_GPU")) options.gpu = select;
    gpu::DeviceOptions device_options;
    device_options.loader_library = FAULT_LOADER;
    const auto database = open_database(options, device_options).value();
    Random random(7);
    const std::vector geometries = {database->add_geometry(make_box({1.0, 2.0, 3.0}), "box").value(),
                                    database->add_geometry(make_sphere(1.5, 1), "ball").value()};
    const auto query = database->prepare(RayQueryOptions{.name = "rays", .capacity = rays}).value();
    const auto transaction = database->make_transaction({.max_writes = 50, .max_queries = 1});
    transaction->begin({});
    const SceneOptions scene;
    for (int i = 0; i < 50; ++i)
      transaction->create(random_row(random, geometries, scene, {}));
    EXPECT_TRUE(database->execute(*transaction).done());
    const auto entities = database->snapshot({}).value();
    const std::span<Ray> asked = query->rays();
    for (std::size_t i = 0; i < asked.size(); i += 8) {
      std::ranges::copy(random_neighbours(random, entities, scene, {}, 0.5), asked.begin() + i);
      for (std::size_t k = 1; k < 8 && !side_by_side; ++k)
        asked[i + k] = random_ray(random, entities, scene, {}, 0.5);
    }
    // What a ray costs is known once some have been asked, and with it how few make a chunk.
    for (int time = 0; time < 3; ++time) {
      transaction->begin({});
      transaction->add_query(*query, rays);
      const std::uint64_t before = loader_.groups();
      const Outcome outcome = database->execute(*transaction);
      groups_ = loader_.groups() - before;
      EXPECT_TRUE(outcome.done()) << describe(outcome);
    }
    std::vector<Answer> answers;
    for (const RayHit& hit : query->hits())
      answers.push_back({hit.status, hit.entity, std::bit_cast<std::uint32_t>(hit.lambda)});
    EXPECT_EQ(database->health().validation_messages, std::vector<std::string>{});
    return answers;
  }

  gpu::test::FaultLoader loader_;
  std::uint64_t groups_ = 0;  ///< that the rays took, with what was built for them
};

TEST_F(DispatchLimit, OfFewGroupsChangesNoAnswer) {
  for (const bool side_by_side : {false, true}) {
    const auto whole = ask_with(0, side_by_side);
    ASSERT_EQ(whole.size(), rays);
    EXPECT_GT(std::ranges::count(whole, HitStatus::hit, &Answer::status), 200);
    for (const std::uint32_t groups : {15u, 8u, 5u}) {
      EXPECT_TRUE(ask_with(groups, side_by_side) == whole)
          << groups << " groups a dispatch, side by side " << side_by_side;
    }
  }
}

/// Behind a chunk's only piece a next one would begin beyond what 32 bits can tell.
TEST_F(DispatchLimit, OfAllGroupsThatCanBeToldIsOnePiece) {
  const auto whole = ask_with(0, false);
  const std::uint64_t groups = groups_;
  EXPECT_GE(groups, rays / 64);
  EXPECT_TRUE(ask_with(std::numeric_limits<std::uint32_t>::max(), false) == whole);
  EXPECT_LT(groups_, 2 * groups) << "some were dispatched again";
}

}  // namespace
}  // namespace rtstdb::test
