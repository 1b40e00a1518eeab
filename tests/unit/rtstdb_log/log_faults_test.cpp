// A disk failure, or a power loss, at each single disk operation.

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <string>

#include "live_world.hpp"
#include "rtstdb/log/writer.hpp"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
namespace {

using hil::test::SimulatedDisk;

constexpr std::uint64_t id_of_log = 77;

/// Runs the same sequence each time, with the faults set on the disk; returns the durable version at its end.
struct Life {
  History history;
  Version told = 0;
  std::uint64_t calls = 0;
};
Life live(SimulatedDisk& disk) {
  Life life;
  hil::test::SimulatedClock clock;
  LiveWorld world(5, life.history, 1 << 12);
  auto writer = Writer::start(disk, clock, world.ring(), world,
                              {.segment_bytes = 4096, .checkpoint_every_bytes = 6000, .rows_per_slice = 5},
                              start_after(recover(disk).value(), id_of_log));
  if (writer) {
    for (int k = 0; k < 40; ++k) {
      if (k == 5 || k == 20) world.add_geometry(disk, id_of_log, static_cast<std::uint64_t>(k));
      if (k % 9 == 4) world.commit_and_discard();
      world.commit();
      writer.value()->step(0);
      if (k % 4 == 0) clock.advance(Nanoseconds(2'000'000'000));
      life.told = std::max(life.told, writer.value()->durable());
    }
    world.recorder().maintain();
    if (writer.value()->close(0).ok()) life.told = world.latest();
  }
  life.calls = disk.calls();
  return life;
}

void expect_nothing_lost(SimulatedDisk& disk, const Life& life) {
  disk.crash();
  const auto recovered = recover(disk);
  ASSERT_TRUE(recovered.ok()) << recovered.error().message;
  const Version version = recovered.value().world.latest.version;
  ASSERT_TRUE(life.history.images.at(version) == image_of(recovered.value().world));
  ASSERT_GE(version, life.history.newest_valid(life.told)) << recovered.value().report.describe();
}

TEST(LogFaults, ErrorAtAnyCallLosesNoDurableVersion) {
  SimulatedDisk whole(1);
  const std::uint64_t calls = live(whole).calls;
  ASSERT_GT(calls, 150u);
  for (const int number : {EIO, ENOSPC}) {
    for (std::uint64_t call = 3; call < calls; ++call) {  // the calls before read the empty directory
      SCOPED_TRACE("error " + std::to_string(number) + " at call " + std::to_string(call));
      SimulatedDisk disk(call);
      disk.fail_call(call, number);
      const Life life = live(disk);
      ASSERT_NO_FATAL_FAILURE(expect_nothing_lost(disk, life));
    }
  }
}

TEST(LogFaults, CrashAtAnyCallLosesNoDurableVersion) {
  SimulatedDisk whole(1);
  const std::uint64_t calls = live(whole).calls;
  for (std::uint64_t call = 3; call < calls; ++call) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE("crash at call " + std::to_string(call) + ", seed " + std::to_string(seed));
      SimulatedDisk disk(100 * call + seed);
      for (std::uint64_t later = call; later < calls + 500; ++later)
        disk.fail_call(later, EIO);
      const Life life = live(disk);
      for (std::uint64_t later = call; later < disk.calls() + 500; ++later)
        disk.fail_call(later, 0);
      ASSERT_NO_FATAL_FAILURE(expect_nothing_lost(disk, life));
    }
  }
}

}  // namespace
}  // namespace rtstdb::log::test
