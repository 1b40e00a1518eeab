// Snapshots, and the engine thread, on which Engine::call executes.

#include "tests/support/simulation/engine.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>

#include <thread>

#include "rtstdb/transaction/monotonic_clock.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

TEST(EngineSnapshot, IsOfTheLatestVersionAPinnedVersionOrATime) {
  World world;
  const EntityId a = world.create(1);
  const EntityId b = world.create(2);
  const auto transaction = world.make();
  Terms later;
  later.world_time = world_time_ns(50);
  transaction->begin(later);
  transaction->remove(a);
  transaction->update(b, row_of(3));
  world.execute(*transaction);

  const auto latest = world.engine.snapshot(ReadAt::latest());
  ASSERT_EQ(latest.value().size(), 1u);
  EXPECT_EQ(latest.value()[0].id, b);
  EXPECT_EQ(latest.value()[0].row.mask, 3u);
  EXPECT_EQ(latest.value()[0].written_by, 3u);
  EXPECT_EQ(world.engine.snapshot(ReadAt::pinned(1)).value().size(), 1u);
  const auto before = world.engine.snapshot(ReadAt::as_of(world_time_ns(49)));
  ASSERT_EQ(before.value().size(), 2u);
  EXPECT_EQ(before.value()[0].id, a);
  EXPECT_EQ(before.value()[1].row.mask, 2u);
  EXPECT_TRUE(world.engine.snapshot(ReadAt::pinned(0)).value().empty());

  const auto refused = world.engine.snapshot(ReadAt::pinned(8));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  EXPECT_EQ(refused.error().message, "unknown_version: version 8 belongs to no version that was published");
}

/// More rows than one slice of the job; with the short history, commits between the slices drop its version.
TEST(EngineSnapshot, IsOfOneVersionDuringWrites) {
  constexpr std::uint32_t entities = 1500;
  for (const std::uint32_t retained : {2000u, 1u << 20}) {
    World world(engine_options(64, entities, retained));
    const auto fill = world.make(entities);
    fill->begin({});
    for (std::uint32_t k = 0; k < entities; ++k)
      fill->create(row_of(0));
    ASSERT_EQ(world.execute(*fill).status, Status::committed);

    std::atomic<bool> stop{false};
    std::thread writer([&] {
      const auto transaction = world.make(entities);
      for (std::uint32_t round = 1; !stop; ++round) {
        transaction->begin({});
        for (std::uint32_t k = 0; k < entities; ++k)
          transaction->update({k, 1}, row_of(round));
        world.execute(*transaction);
      }
    });
    for (int round = 0; round < 40; ++round) {
      const auto states = world.engine.snapshot(ReadAt::latest());
      ASSERT_TRUE(states.ok());
      ASSERT_EQ(states.value().size(), entities);
      for (const EntityState& state : states.value()) {
        ASSERT_EQ(state.row.mask, states.value()[0].row.mask) << "rows of two versions";
      }
    }
    stop = true;
    writer.join();
  }
}

TEST(EngineThread, HasItsPriorityOrReportsTheRefusal) {
  SimulatedClock clock;
  SimulatedExecutor executor;
  EngineOptions options = engine_options();
  options.thread_priority = 7;
  Engine engine(options, executor, clock);
  int policy = 0;
  int priority = 0;
  engine.call([&] {
    policy = sched_getscheduler(0);
    sched_param parameters{};
    sched_getparam(0, &parameters);
    priority = parameters.sched_priority;
  });
  if (engine.degraded().empty()) {
    EXPECT_EQ(policy, SCHED_FIFO);
    EXPECT_EQ(priority, 7);
  } else {
    EXPECT_EQ(policy, SCHED_OTHER);
    ASSERT_EQ(engine.degraded().size(), 1u);
    EXPECT_EQ(
        engine.degraded()[0].rfind("the database's engine thread runs without SCHED_FIFO priority 7: ", 0),
        0u)
        << engine.degraded()[0];
  }

  EngineOptions impossible = engine_options();
  impossible.thread_priority = 1000;
  Engine refused(impossible, executor, clock);
  ASSERT_EQ(refused.degraded().size(), 1u);
  EXPECT_NE(refused.degraded()[0].find("1000: Invalid argument"), std::string::npos) << refused.degraded()[0];
}

TEST(EngineThread, BlocksSignals) {
  World world;
  sigset_t blocked;
  world.engine.call([&] { pthread_sigmask(SIG_SETMASK, nullptr, &blocked); });
  EXPECT_TRUE(sigismember(&blocked, SIGINT));
  EXPECT_TRUE(sigismember(&blocked, SIGTERM));
  sigset_t callers;
  pthread_sigmask(SIG_SETMASK, nullptr, &callers);
  EXPECT_FALSE(sigismember(&callers, SIGINT)) << "the caller's mask is unchanged";
}

TEST(EngineThread, UsesNoProcessorTimeWhenIdle) {
  World world;
  world.create(1);
  timespec before{};
  timespec after{};
  world.engine.call([&] { clock_gettime(CLOCK_THREAD_CPUTIME_ID, &before); });
  std::this_thread::sleep_for(200ms);  // real time is the subject: the thread has to stay idle for a while
  world.engine.call([&] { clock_gettime(CLOCK_THREAD_CPUTIME_ID, &after); });
  const double used_s = static_cast<double>(after.tv_sec - before.tv_sec) +
                        static_cast<double>(after.tv_nsec - before.tv_nsec) * 1e-9;
  EXPECT_LT(used_s, 0.05);
}

TEST(MonotonicClock, IsClockMonotonic) {
  const MonotonicClock clock;
  timespec kernel{};
  clock_gettime(CLOCK_MONOTONIC, &kernel);
  const auto before = clock_time_ns(std::int64_t{kernel.tv_sec} * 1'000'000'000 + kernel.tv_nsec);
  const ClockTime now = clock.now();
  EXPECT_GE(now, before);
  EXPECT_LT(now, before + 5s);
  EXPECT_FALSE(clock.is_virtual());
}

}  // namespace
}  // namespace rtstdb::transaction::test
