// A disk that stands still for seconds while a loop commits each millisecond in async mode: the loop misses
// nothing but for what the machine itself took (MachineTime), or what it misses as often beside a disk that
// is well, and the log says how full its ring was.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <thread>
#include <vector>

#include "rtstdb/transaction/engine.hpp"
#include "tests/long/machine_time.hpp"
#include "tests/support/simulation/disk.hpp"
#include "tests/support/simulation/no_queries.hpp"

namespace hil::stress {
namespace {

using namespace rtstdb;
using namespace std::chrono_literals;
using Time = std::chrono::steady_clock::time_point;
using test::SimulatedDisk;

constexpr auto period = 1ms;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::chrono::milliseconds stall = 2s;
#else
constexpr std::chrono::milliseconds stall = 5s;
#endif
/// Longer than any machine keeps a thread from running in this test, and much shorter than the stall.
constexpr auto never_that_long = stall / 2;

/// A miss that the machine's account, which is kept in coarse steps and does not know all that a host takes,
/// does not explain is looked for again; one that comes of the disk comes each time. On a machine that others
/// share two rounds of five have such a one, on some every round, with the disk and without.
constexpr int rounds = 4;
/// What a commit of one row takes in the ring where it changes nothing, not even the time.
constexpr std::size_t min_record_bytes = 24;

/// What a loop of one millisecond saw.
struct Loop {
  std::size_t ticks = 0, misses = 0;  ///< not done before the next tick
  std::size_t unexcused = 0;          ///< misses by more than the machine took meanwhile
  std::chrono::nanoseconds longest{0}, median{0};
};

template <class Tick>
Loop run_loop(const MachineTime& machine, std::chrono::nanoseconds length, const Tick& tick) {
  Loop loop;
  std::vector<std::chrono::nanoseconds> took;
  const Time end = std::chrono::steady_clock::now() + length;
  for (Time release = {}; release < end;) {
    const Nanoseconds taken_before = machine.taken();
    release = std::max(release + period, std::chrono::steady_clock::now());  // to look is no part of it
    std::this_thread::sleep_until(release);
    const Time started = std::chrono::steady_clock::now();
    tick();
    const Time ended = std::chrono::steady_clock::now();
    took.push_back(ended - started);
    const Nanoseconds late = ended - (release + period);
    if (late <= 0ns) continue;
    ++loop.misses;
    loop.unexcused += late > machine.taken() - taken_before;
  }
  loop.ticks = took.size();
  std::ranges::sort(took);
  loop.longest = took.back();
  loop.median = took[took.size() / 2];
  return loop;
}

/// Whether so many more unexcused misses of one loop than of another, as long a one, are more than chance
/// has.
bool is_more_than_chance(std::size_t more, std::size_t fewer) {
  const auto difference = static_cast<double>(more) - static_cast<double>(fewer);
  return difference > 3.0 * std::sqrt(static_cast<double>(more + fewer));
}

double in_us(std::chrono::nanoseconds time) {
  return static_cast<double>(time.count()) / 1e3;
}

/// A database in async mode whose disk stands still when it is told to.
class Stalled {
 public:
  explicit Stalled(SimulatedDisk& disk) {
    disk.before_each([this](log::DiskCall call) {
      if (call != log::DiskCall::sync || !stalls_) return;
      stood_ = true;
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
  ~Stalled() { set_stalls(false); }
  Stalled(const Stalled&) = delete;
  Stalled& operator=(const Stalled&) = delete;

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
  bool stood() const { return stood_; }
  transaction::Engine& engine() { return *engine_; }

 private:
  std::atomic<bool> stalls_{false}, stood_{false};
  test::NoQueries executor_;
  transaction::MonotonicClock clock_;
  std::unique_ptr<transaction::Engine> engine_;
  std::unique_ptr<Transaction> transaction_;
  EntityId id_;
};

TEST(StalledDisk, TheLoopMissesNothingForIt) {
  SimulatedDisk disk(1);
  Stalled stalled_disk(disk);
  transaction::Engine& engine = stalled_disk.engine();
  const MachineTime machine;
  std::size_t done = 0;
  const auto commit = [&] { done += stalled_disk.commit(); };

  std::size_t unexcused_healthy = 0, unexcused_stalled = 0;
  for (int round = 0; round < rounds; ++round) {
    const Loop healthy = run_loop(machine, stall, commit);
    stalled_disk.set_stalls(true);
    done = 0;
    const Loop stalled = run_loop(machine, stall, commit);
    const Durability during = engine.log()->state();
    stalled_disk.set_stalls(false);

    ASSERT_TRUE(stalled_disk.stood());
    ASSERT_EQ(done, stalled.ticks) << "every tick committed";
    EXPECT_LT(stalled.longest, never_that_long) << "a tick waited for the disk";
    EXPECT_LT(stalled.median, healthy.median * 5 + 1ms);
    EXPECT_EQ(during.commits_in_gaps, 0u) << "the ring holds what comes in that time";
    EXPECT_GE(during.ring_high_water, stalled.ticks / 2 * min_record_bytes);
    EXPECT_LE(during.ring_high_water, during.ring_bytes);
    EXPECT_LT(during.durable, engine.latest().version);
    EXPECT_TRUE(engine.log()->wait_until_durable(engine.latest().version, 60s)) << "whole again";
    std::cout << "stalled for " << stall.count() << " ms: " << stalled.ticks << " ticks, " << stalled.misses
              << " missed, " << stalled.unexcused << " of them not for what the machine took, before "
              << healthy.unexcused << "; median " << in_us(stalled.median) << " us, before "
              << in_us(healthy.median) << " us; longest " << in_us(stalled.longest) << " us, before "
              << in_us(healthy.longest) << " us; ring " << during.ring_high_water << " of "
              << during.ring_bytes << " bytes\n";
    if (stalled.unexcused == 0) return;
    unexcused_healthy += healthy.unexcused;
    unexcused_stalled += stalled.unexcused;
  }
  EXPECT_FALSE(is_more_than_chance(unexcused_stalled, unexcused_healthy))
      << "ticks were late for the disk: " << unexcused_stalled << ", without it " << unexcused_healthy;
}

}  // namespace
}  // namespace hil::stress
