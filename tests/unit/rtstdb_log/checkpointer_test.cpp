// Checkpoints of a source that is not ready at once.

#include "rtstdb/log/checkpointer.hpp"

#include <gtest/gtest.h>

#include "rtstdb/log/checkpoint_reader.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
namespace {

using hil::tests::SimulatedDisk;

/// A source of an empty world, available when `ready`.
class SlowWorld final : public WorldSource {
 public:
  std::optional<WorldHead> begin(Version /*not_before*/) override {
    if (!ready) return std::nullopt;
    WorldHead head;
    head.version = {version, at};
    head.next_version = version + 1;
    head.materials = materials;
    head.lights = lights;
    return head;
  }
  bool rows(std::uint32_t /*first*/, std::span<EntityState> /*states*/) override { return true; }
  bool shape(GeometryId /*geometry*/, Shape& /*shape*/) override { return true; }
  void end() noexcept override {}

  bool ready = false;
  Version version = 10;
  std::vector<LoggedMaterial> materials;
  std::vector<LoggedLight> lights;
  WorldTime at = world_time_ns(1'000);
};

class CheckpointerTest : public testing::Test {
 protected:
  /// The header of the finished checkpoint.
  CheckpointHeader finished() {
    while (checkpointer.in_progress())
      checkpointer.advance({.version = 100}, now);
    const auto header = read_checkpoint_header(disk, 1);
    EXPECT_TRUE(header.ok()) << header.error().message;
    return header.ok() ? header.value() : CheckpointHeader{};
  }
  SimulatedDisk disk{1};
  SlowWorld world;
  const ClockTime now = clock_time_ns(1);
  Checkpointer checkpointer{disk, world, 77, 1, 64, {Nanoseconds(1), Nanoseconds(1)}};
};

TEST_F(CheckpointerTest, WaitsUntilItsMaterialsAndLightsAreOnDisk) {
  world.ready = true;
  world.materials = {{{1}, "paint", {}}};
  world.lights = {{{0}, "lamp", {.intensity_cd = 1.0}}, {{1}, "sun", {.intensity_cd = 2.0}}};
  checkpointer.begin({.segment = 5, .offset = 512, .group = 8, .link = 1}, 9, now, 0);
  const auto is_finished = [&](const AddedCounts& added) {
    for (int step = 0; step < 10; ++step)
      if (checkpointer.advance({.version = 10, .added = added}, now).progress ==
          Checkpointer::Progress::finished)
        return true;
    return false;
  };
  EXPECT_FALSE(is_finished({.geometries = 0, .materials = 0, .lights = 2}));
  EXPECT_FALSE(is_finished({.geometries = 0, .materials = 1, .lights = 1}));
  ASSERT_TRUE(is_finished({.geometries = 0, .materials = 1, .lights = 2}));
  const auto checkpoint = read_checkpoint(disk, 1, 77);
  ASSERT_TRUE(checkpoint.ok()) << checkpoint.error().message;
  EXPECT_EQ(checkpoint.value().world.materials.size(), 1u);
  ASSERT_EQ(checkpoint.value().world.lights.size(), 2u);
  EXPECT_EQ(checkpoint.value().world.lights[1].value, (Light{.intensity_cd = 2.0}));
}

TEST_F(CheckpointerTest, KeepsThePositionOfTheFirstRequest) {
  EXPECT_EQ(checkpointer.begin({.segment = 5, .offset = 512, .group = 8, .link = 1}, 9, now, 0).progress,
            Checkpointer::Progress::nothing);
  world.ready = true;
  EXPECT_EQ(checkpointer.begin({.segment = 5, .offset = 1024, .group = 9, .link = 2}, 9, now, 0).progress,
            Checkpointer::Progress::something);
  const CheckpointHeader header = finished();
  EXPECT_EQ(header.segment, 5u);
  EXPECT_EQ(header.offset, 512u);
  EXPECT_EQ(header.group, 8u);
}

/// A failed segment is not trusted: a checkpoint whose position is in it would make recovery read it.
TEST_F(CheckpointerTest, ForgetsThePositionWhenAbandoned) {
  EXPECT_EQ(checkpointer.begin({.segment = 5, .offset = 512, .group = 8, .link = 1}, 9, now, 0).progress,
            Checkpointer::Progress::nothing);
  checkpointer.abandon();
  world.ready = true;
  EXPECT_EQ(checkpointer.begin({.segment = 6, .offset = 64, .group = 8, .link = 1}, 9, now, 0).progress,
            Checkpointer::Progress::something);
  EXPECT_EQ(finished().segment, 6u);
}

/// The world of an earlier request is too old for the position of the new one.
TEST_F(CheckpointerTest, AbandonsAWorldOlderThanTheNewPosition) {
  checkpointer.begin({.segment = 5, .offset = 512, .group = 8, .link = 1}, 9, now, 0);
  checkpointer.abandon();
  world.ready = true;
  EXPECT_EQ(checkpointer.begin({.segment = 6, .offset = 64, .group = 8, .link = 1}, 11, now, 0).progress,
            Checkpointer::Progress::abandoned);
  EXPECT_FALSE(checkpointer.in_progress());
}

}  // namespace
}  // namespace rtstdb::log::test
