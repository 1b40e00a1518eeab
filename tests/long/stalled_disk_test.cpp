// A loop commits each millisecond in async mode while the disk stalls for seconds. It misses only ticks that
// delays of the machine excuse (MachineDelay), or as many as with a healthy disk.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <thread>
#include <vector>

#include "rtstdb/transaction/engine.hpp"
#include "tests/long/machine_delay.hpp"
#include "tests/support/simulation/disk.hpp"
#include "tests/support/simulation/no_queries.hpp"

namespace hil::long_test {
namespace {

using namespace rtstdb;
using namespace std::chrono_literals;
using Time = std::chrono::steady_clock::time_point;
using tests::SimulatedDisk;

constexpr auto period = 1ms;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::chrono::milliseconds stall = 2s;
#else
constexpr std::chrono::milliseconds stall = 5s;
#endif
/// Longer than any delay of a machine, and much shorter than the stall.
constexpr auto max_tick = stall / 2;

/// A round with unexcused misses is repeated, since not every delay of the machine is measured. Misses that
/// the disk causes occur in each round.
constexpr int rounds = 4;
/// The size of the smallest record in the ring.
constexpr std::size_t min_record_bytes = 24;

/// The result of a loop with a period of one millisecond.
struct Loop {
  std::size_t ticks = 0, misses = 0;  ///< not done before the next tick
  std::size_t unexcused = 0;          ///< later than the delays of the machine in the tick
  std::chrono::nanoseconds longest{0}, median{0};
};

template <class Tick>
Loop run_loop(const MachineDelay& machine, std::chrono::nanoseconds length, const Tick& tick) {
  Loop loop;
  std::vector<std::chrono::nanoseconds> took;
  const Time end = std::chrono::steady_clock::now() + length;
  for (Time release = {}; release < end;) {
    const Nanoseconds delay_before = machine.total();
    release = std::max(release + period,
                       std::chrono::steady_clock::now());  // reading the delays is not part of the tick
    std::this_thread::sleep_until(release);
    const Time started = std::chrono::steady_clock::now();
    tick();
    const Time ended = std::chrono::steady_clock::now();
    took.push_back(ended - started);
    const Nanoseconds late = ended - (release + period);
    if (late <= 0ns) continue;
    ++loop.misses;
    loop.unexcused += late > machine.total() - delay_before;
  }
  loop.ticks = took.size();
  std::ranges::sort(took);
  loop.longest = took.back();
  loop.median = took[took.size() / 2];
  return loop;
}

/// Whether the difference of two counts is significant (three standard deviations).
bool is_more_than_chance(std::size_t more, std::size_t fewer) {
  const auto difference = static_cast<double>(more) - static_cast<double>(fewer);
  return difference > 3.0 * std::sqrt(static_cast<double>(more + fewer));
}

double in_us(std::chrono::nanoseconds time) {
  return static_cast<double>(time.count()) / 1e3;
}

/// A database in async mode whose disk stalls on request.
class StallingDatabase {
 public:
  explicit StallingDatabase(SimulatedDisk& disk) {
    disk.before_each([this](log::DiskCall call) {
      if (call != log::DiskCall::sync || !stalls_) return;
      has_stalled_ = true;
      stalls_.wait(true);
    });
    transaction::CommitLogOptions options;
    options.durability.ring_bytes = std::size_t{2} << 20;
    auto opened =
        transaction::CommitLog::open(std::shared_ptr<log::Disk>(std::shared_ptr<void>(), &disk), options);
    transaction::EngineOptions engine_options;
    engine_options.store.geometry_known = [](GeometryId id) { return !id.valid(); };
    engine_ =
        std::make_unique<transaction::Engine>(engine_options, executor_, clock_, std::move(opened).value());
    transaction_ = engine_->make_transaction({.max_writes = 1});
    transaction_->begin({});
    transaction_->create({});
    engine_->submit(*transaction_);
    EXPECT_TRUE(engine_->wait(*transaction_).done());
    id_ = transaction_->created(0);
  }
  ~StallingDatabase() { set_stalls(false); }
  StallingDatabase(const StallingDatabase&) = delete;
  StallingDatabase& operator=(const StallingDatabase&) = delete;

  void set_stalls(bool stalls) {
    stalls_ = stalls;
    stalls_.notify_all();
  }
  bool commit() {
    transaction_->begin({});
    transaction_->update_motion(id_, {});
    engine_->submit(*transaction_);
    return engine_->wait(*transaction_).done();
  }
  bool has_stalled() const { return has_stalled_; }
  transaction::Engine& engine() { return *engine_; }

 private:
  std::atomic<bool> stalls_{false}, has_stalled_{false};
  tests::NoQueries executor_;
  transaction::MonotonicClock clock_;
  std::unique_ptr<transaction::Engine> engine_;
  std::unique_ptr<Transaction> transaction_;
  EntityId id_;
};

TEST(StalledDisk, CausesNoMissedTicks) {
  SimulatedDisk disk(1);
  StallingDatabase database(disk);
  transaction::Engine& engine = database.engine();
  const MachineDelay machine;
  std::size_t done = 0;
  const auto commit = [&] { done += database.commit(); };

  std::size_t unexcused_healthy = 0, unexcused_stalled = 0;
  for (int round = 0; round < rounds; ++round) {
    const Loop healthy = run_loop(machine, stall, commit);
    database.set_stalls(true);
    done = 0;
    const Loop stalled = run_loop(machine, stall, commit);
    const Durability during = engine.log()->state();
    database.set_stalls(false);

    ASSERT_TRUE(database.has_stalled());
    ASSERT_EQ(done, stalled.ticks) << "every tick committed";
    EXPECT_LT(stalled.longest, max_tick) << "a tick has waited for the disk";
    EXPECT_LT(stalled.median, healthy.median * 5 + 1ms);
    EXPECT_EQ(during.commits_in_gaps, 0u) << "the ring holds all records of the stall";
    EXPECT_GE(during.ring_high_water, stalled.ticks / 2 * min_record_bytes);
    EXPECT_LE(during.ring_high_water, during.ring_bytes);
    EXPECT_LT(during.durable, engine.latest().version);
    EXPECT_TRUE(engine.log()->wait_until_durable(engine.latest().version, 60s));
    std::cout << "stalled for " << stall.count() << " ms: " << stalled.ticks << " ticks, " << stalled.misses
              << " missed, " << stalled.unexcused << " of them without a delay of the machine, before "
              << healthy.unexcused << "; median " << in_us(stalled.median) << " us, before "
              << in_us(healthy.median) << " us; longest " << in_us(stalled.longest) << " us, before "
              << in_us(healthy.longest) << " us; ring " << during.ring_high_water << " of "
              << during.ring_bytes << " bytes\n";
    if (stalled.unexcused == 0) return;
    unexcused_healthy += healthy.unexcused;
    unexcused_stalled += stalled.unexcused;
  }
  EXPECT_FALSE(is_more_than_chance(unexcused_stalled, unexcused_healthy))
      << unexcused_stalled << " unexcused misses with the stall, " << unexcused_healthy << " without";
}

}  // namespace
}  // namespace hil::long_test
