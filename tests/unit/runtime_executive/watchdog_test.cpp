#include "runtime/executive/watchdog.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "runtime/executive/executive.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using std::chrono::milliseconds;
using testing::ScriptedTask;
using testing::spec_of;
constexpr std::int64_t ms = 1'000'000;

TEST(Watchdog, DefaultTimeoutIsTheLongerOfTheTwo) {
  EXPECT_EQ(effective_timeout_ns({}, 1 * ms), 100 * ms);
  EXPECT_EQ(effective_timeout_ns({}, 10 * ms), 500 * ms);
  EXPECT_EQ(effective_timeout_ns({20 * ms, {}}, 10 * ms), 20 * ms);
}

TEST(Watchdog, CallsTheSafeStateOnceAndRecordsTheHang) {
  std::atomic<int> calls{0};
  MonotonicClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  options.duration_ticks = 700;
  options.watchdog.timeout_ns = 100 * ms;
  options.watchdog.safe_state = [&] { ++calls; };
  std::atomic<int> calls_during_hang{0};
  ScriptedTask task([&](const TickInfo& tick) {
    if (tick.tick != 50) return;
    while (calls == 0)
      std::this_thread::sleep_for(milliseconds(1));
    std::this_thread::sleep_for(milliseconds(200));  // two more time-outs
    calls_during_hang = calls.load();
  });
  Executive executive(options);
  executive.add_task(spec_of("t"), task);
  const std::atomic<bool> stop{false};
  const RunResult result = executive.run(stop);
  EXPECT_EQ(calls_during_hang, 1) << "while the base thread still hangs";
  EXPECT_EQ(calls, 1);
  ASSERT_TRUE(result.hang.has_value());
  EXPECT_LE(result.hang->ticks_begun, 51U);
  EXPECT_GE(result.hang->ticks_begun, 1U);
  EXPECT_GE(result.hang->silent_ns, 100 * ms);
  EXPECT_EQ(result.run_time_ns, 700 * ms) << "the run goes on when the base thread comes back";
}

TEST(Watchdog, StaysQuietWhileTicksAreMade) {
  std::atomic<std::uint64_t> ticks{0};
  std::atomic<int> calls{0};
  Watchdog watchdog({0, [&] { ++calls; }}, 400 * ms, ticks);
  std::this_thread::sleep_for(milliseconds(600));
  EXPECT_EQ(calls, 0) << "before the first tick there is nothing to watch";
  for (int i = 0; i < 120; ++i) {
    ++ticks;
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_FALSE(watchdog.stop().has_value());
  EXPECT_EQ(calls, 0);
}

TEST(Watchdog, IsOffUnderTheVirtualClock) {
  std::atomic<int> calls{0};
  VirtualClock clock;
  ExecutiveOptions options;
  options.clock = &clock;
  options.duration_ticks = 2;
  options.watchdog.timeout_ns = 20 * ms;
  options.watchdog.safe_state = [&] { ++calls; };
  ScriptedTask task([](const TickInfo&) { std::this_thread::sleep_for(milliseconds(100)); });
  Executive executive(options);
  executive.add_task(spec_of("t"), task);
  const std::atomic<bool> stop{false};
  EXPECT_FALSE(executive.run(stop).hang.has_value());
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace hil::executive
