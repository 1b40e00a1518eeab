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
    return head;
  }
  bool rows(std::uint32_t /*first*/, std::span<EntityState> /*states*/) override { return true; }
  bool shape(GeometryId /*geometry*/, Shape& /*shape*/) override { return true; }
  void end() noexcept override {}

  bool ready = false;
  Version version = 10;
  WorldTime at = world_time_ns(1'000);
};

class CheckpointerTest : public testing::Test {
 protected:
  /// The header of the finished checkpoint.
  CheckpointHeader finished() {
    while (checkpointer.in_progress())
      checkpointer.advance({.version = 100, .geometries = 0}, now);
    const auto header = read_checkpoint_header(disk, 1);
    EXPECT_TRUE(header.ok()) << header.error().message;
    return header.ok() ? header.value() : CheckpointHeader{};
  }
  SimulatedDisk disk{1};
  SlowWorld world;
  const ClockTime now = clock_time_ns(1);
  Checkpointer checkpointer{disk, world, 77, 1, 64, {Nanoseconds(1), Nanoseconds(1)}};
};

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
