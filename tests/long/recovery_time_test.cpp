// Recovery of a hundred thousand entities and ten seconds of log takes at most 3 s. The log is that of a loop
// that moves a hundred entities each millisecond.

#include <gtest/gtest.h>

#include <iostream>
#include <vector>

#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/transaction/engine.hpp"
#include "tests/support/simulation/no_queries.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::long_test {
namespace {

using namespace rtstdb;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::uint32_t entities = 10'000, ticks = 1'000;
constexpr std::int64_t max_recovery_ns = 60'000'000'000;
#else
constexpr std::uint32_t entities = 100'000, ticks = 10'000;
constexpr std::int64_t max_recovery_ns = 3'000'000'000;
#endif
constexpr std::uint32_t moved = 100;

class RecoveryTime : public testing::Test {
 protected:
  std::unique_ptr<transaction::CommitLog> open_log() {
    transaction::CommitLogOptions options;
    options.durability.mode = DurabilityMode::async;
    options.durability.checkpoint_every_bytes = 0;  // recovery reads the whole log
    options.durability.ring_bytes = std::size_t{64} << 20;
    options.max_entities = entities;
    auto disk = log::open_directory(directory_.path());
    EXPECT_TRUE(disk);
    auto opened = transaction::CommitLog::open(std::move(disk.value()), options);
    EXPECT_TRUE(opened.ok()) << opened.error().message;
    return std::move(opened).value();
  }
  transaction::EngineOptions engine_options() {
    transaction::EngineOptions options;
    options.store.max_entities = entities;
    options.store.geometry_known = [](GeometryId id) { return !id.valid(); };
    return options;
  }

  const tests::TemporaryFolder directory_;
  tests::NoQueries executor_;
  transaction::MonotonicClock clock_;
};

TEST_F(RecoveryTime, IsBoundedForTenSecondsOfLog) {
  Version last = 0;
  {
    transaction::Engine engine(engine_options(), executor_, clock_, open_log());
    const auto transaction = engine.make_transaction({.max_writes = 1000});
    const auto commit = [&] {
      engine.submit(*transaction);
      ASSERT_TRUE(engine.wait(*transaction).done()) << describe(transaction->outcome());
      last = transaction->outcome().version;
      // The loop waits, so that the ring is never full.
      if (last % 100 != 0) return;
      ASSERT_TRUE(engine.log()->wait_until_durable(last, Nanoseconds(60'000'000'000)));
    };
    for (std::uint32_t first = 0; first < entities; first += 1000) {
      transaction->begin({});
      for (std::uint32_t k = 0; k < 1000; ++k)
        transaction->create({});
      commit();
    }
    Motion motion;
    for (std::uint32_t tick = 1; tick <= ticks; ++tick) {
      transaction->begin({});
      motion.p_world_m.x = tick;
      for (std::uint32_t k = 0; k < moved; ++k)
        transaction->update_motion({(tick * moved + k) % entities, 1}, motion);
      commit();
    }
    ASSERT_TRUE(engine.log()->wait_until_durable(last, Nanoseconds(60'000'000'000)));
    ASSERT_EQ(engine.log()->state().commits_in_gaps, 0u);
  }
  const ClockTime begun = clock_.now();
  transaction::Engine engine(engine_options(), executor_, clock_, open_log());
  const Nanoseconds duration = clock_.now() - begun;
  EXPECT_EQ(engine.latest().version, last);
  EXPECT_EQ(engine.log()->recovery().commits, last);
  const auto states = engine.snapshot(ReadAt::latest());
  ASSERT_TRUE(states.ok());
  ASSERT_EQ(states.value().size(), entities);
  for (std::uint32_t k = 0; k < moved; ++k)
    EXPECT_EQ(states.value()[(ticks * moved + k) % entities].row.motion.p_world_m.x, ticks);
  EXPECT_LE(duration.count(), max_recovery_ns);
  std::cout << entities << " entities and " << ticks << " ticks of log recovered in "
            << static_cast<double>(duration.count()) / 1e6 << " ms\n";
}

}  // namespace
}  // namespace hil::long_test
