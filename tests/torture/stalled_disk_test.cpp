// A disk that stands still for seconds while a loop commits each millisecond in async mode: the loop does not wait for it, and the log says
// how full its ring was.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <thread>
#include <vector>

#include "rtstdb/transaction/engine.hpp"
#include "tests/support/simulated_disk.hpp"

namespace hil::torture {
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

class NoQueries final : public query::Executor {
 public:
  query::RunReport run(const query::RowSource&, std::span<const query::Request>, const query::TimeSpan&,
                       query::Meanwhile*) noexcept override {
    return {};
  }
};

/// What a loop of one millisecond saw.
struct Loop {
  std::size_t ticks = 0, misses = 0;  ///< not done before the next tick
  std::chrono::nanoseconds longest{0}, median{0};
};

template <class Tick>
Loop run_loop(std::chrono::nanoseconds length, const Tick& tick) {
  Loop loop;
  std::vector<std::chrono::nanoseconds> took;
  const Time begin = std::chrono::steady_clock::now();
  for (Time release = begin; release - begin < length; release += period) {
    std::this_thread::sleep_until(release);
    const Time started = std::chrono::steady_clock::now();
    tick();
    const Time ended = std::chrono::steady_clock::now();
    took.push_back(ended - started);
    if (ended > release + period) ++loop.misses;
    release = std::max(release, ended - period);  // a pause is one miss
  }
  loop.ticks = took.size();
  std::ranges::sort(took);
  loop.longest = took.back();
  loop.median = took[took.size() / 2];
  return loop;
}

double in_us(std::chrono::nanoseconds time) {
  return static_cast<double>(time.count()) / 1e3;
}

TEST(StalledDisk, TheLoopDoesNotWaitForIt) {
  SimulatedDisk disk(1);
  std::atomic<bool> stalls{false};
  std::atomic<bool> stood{false};
  disk.before_each([&](log::DiskCall call) {
    if (call != log::DiskCall::sync || !stalls) return;
    stood = true;
    stalls.wait(true);
  });
  transaction::CommitLogOptions options;
  options.durability.ring_bytes = std::size_t{2} << 20;
  auto opened =
      transaction::CommitLog::open(std::shared_ptr<log::Disk>(std::shared_ptr<void>(), &disk), options);
  ASSERT_TRUE(opened.ok());
  NoQueries executor;
  transaction::MonotonicClock clock;
  transaction::EngineOptions engine_options;
  engine_options.store.geometry_known = [](GeometryId id) { return !id.valid(); };
  transaction::Engine engine(engine_options, executor, clock, std::move(opened).value());
  const auto transaction = engine.make_transaction({.max_writes = 1});
  transaction->begin({});
  transaction->create({});
  engine.submit(*transaction);
  ASSERT_TRUE(engine.wait(*transaction).done());
  const EntityId id = transaction->created(0);
  std::size_t done = 0;
  const auto commit = [&] {
    transaction->begin({});
    transaction->update_motion(id, {});
    engine.submit(*transaction);
    if (engine.wait(*transaction).done()) ++done;
  };

  const Loop healthy = run_loop(stall / 5, commit);
  stalls = true;
  Loop bare;
  std::thread beside([&] { bare = run_loop(stall, [] {}); });
  done = 0;
  const Loop stalled = run_loop(stall, commit);
  beside.join();
  const Durability during = engine.log()->state();
  stalls = false;
  stalls.notify_all();

  EXPECT_TRUE(stood);
  EXPECT_EQ(done, stalled.ticks) << "every tick committed";
  EXPECT_LT(stalled.longest, never_that_long) << "a tick waited for the disk";
  EXPECT_LT(stalled.median, healthy.median * 5 + 1ms);
  EXPECT_GT(during.ring_high_water, 0u);
  EXPECT_EQ(during.commits_in_gaps, 0u) << "the ring holds what comes in that time";
  EXPECT_LT(during.durable, engine.latest().version);
  EXPECT_TRUE(engine.log()->wait_until_durable(engine.latest().version, 60s)) << "whole again";
  std::cout << "stalled for " << stall.count() << " ms: " << stalled.ticks << " ticks, " << stalled.misses
            << " missed, beside " << bare.misses << " of a bare loop; median " << in_us(stalled.median)
            << " us, before " << in_us(healthy.median) << " us; longest " << in_us(stalled.longest)
            << " us, before " << in_us(healthy.longest) << " us; ring " << during.ring_high_water << " of "
            << during.ring_bytes << " bytes\n";
}

}  // namespace
}  // namespace hil::torture
