#pragma once
// A fixture with a writer on a simulated disk, and its world.

#include <gtest/gtest.h>

#include <memory>

#include "live_world.hpp"
#include "rtstdb/log/writer.hpp"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {

using hil::tests::SimulatedDisk;

inline constexpr std::uint64_t database_id = 77;

class WriterTest : public testing::Test {
 protected:
  explicit WriterTest(std::size_t ring_bytes = 1 << 14) : world(1, history, ring_bytes) {}

  void start(const WriterOptions& options = {.segment_bytes = 8192, .checkpoint_every_bytes = 0}) {
    auto started = Writer::start(disk, clock, world.ring(), world, options,
                                 start_after(recover(disk).value(), database_id));
    ASSERT_TRUE(started.ok()) << started.error().message;
    writer = std::move(started).value();
  }
  void settle() { write_all(*writer); }
  void commit(int count) {
    for (; count > 0; --count)
      world.commit();
  }
  /// The worst contents of the disk after a power loss.
  Version version_after_crash() {
    disk.at_crash_keep(SimulatedDisk::Keeps::nothing);
    disk.crash();
    auto recovered = recover(disk);
    EXPECT_TRUE(recovered.ok()) << recovered.error().message;
    if (!recovered) return 0;
    const Version version = recovered.value().world.latest.version;
    EXPECT_TRUE(image_of(recovered.value().world) == history.images.at(version));
    return version;
  }

  SimulatedDisk disk{1};
  hil::tests::SimulatedClock clock;
  History history;
  LiveWorld world;
  std::unique_ptr<Writer> writer;
};

}  // namespace rtstdb::log::test
