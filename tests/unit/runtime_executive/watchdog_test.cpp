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
using test::ScriptedTask;
using test::spec_of;
constexpr std::int64_t ms = 1'000'000;

// These tests sleep, since a watchdog measures real time: the sleeps are several time-outs long, after which
// a wrong watchdog would have detected a hang.

TEST(Watchdog, DefaultTimeoutIs100MsOr50Periods) {
  EXPECT_EQ(effective_timeout_ns({}, 1 * ms), 100 * ms);
  EXPECT_EQ(effective_timeout_ns({}, 10 * ms), 500 * ms);
  EXPECT_EQ(effective_timeout_ns({20 * ms, {}}, 10 * ms), 20 * ms);
}

TEST(Watchdog, HangIsReportedAndSetsTheSafeStateOnce) {
  std::atomic<int> calls{0};
  test::ClockRun<MonotonicClock> run(700);
  run.options.watchdog.timeout_ns = 100 * ms;
  run.options.watchdog.safe_state = [&] { ++calls; };
  std::atomic<int> calls_during_hang{0};
  ScriptedTask task([&](const TickInfo& tick) {
    if (tick.tick != 50) return;
    while (calls == 0)
      std::this_thread::sleep_for(milliseconds(1));
    std::this_thread::sleep_for(milliseconds(200));  // real time is the subject: two time-outs
    calls_during_hang = calls.load();
  });
  const RunResult result = run.run({{spec_of("t"), &task}});
  EXPECT_EQ(calls_during_hang, 1) << "during the hang";
  EXPECT_EQ(calls, 1);
  ASSERT_TRUE(result.hang.has_value());
  EXPECT_LE(result.hang->ticks_begun, 51U);
  EXPECT_GE(result.hang->ticks_begun, 1U);
  EXPECT_GE(result.hang->silent_ns, 100 * ms);
  EXPECT_EQ(result.run_time_ns, 700 * ms) << "the run continues after the hang";
}

TEST(Watchdog, DetectsNoHangWhileTicksContinue) {
  std::atomic<std::uint64_t> ticks{0};
  std::atomic<int> calls{0};
  Watchdog watchdog({0, [&] { ++calls; }}, 400 * ms, ticks);
  std::this_thread::sleep_for(milliseconds(600));  // real time is the subject: longer than the time-out
  EXPECT_EQ(calls, 0) << "it watches from the first tick on";
  for (int i = 0; i < 120; ++i) {
    ++ticks;
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_FALSE(watchdog.stop().has_value());
  EXPECT_EQ(calls, 0);
}

TEST(Watchdog, IsOffUnderTheVirtualClock) {
  std::atomic<int> calls{0};
  test::ClockRun<VirtualClock> run(2);
  run.options.watchdog.timeout_ns = 20 * ms;
  run.options.watchdog.safe_state = [&] { ++calls; };
  ScriptedTask task([](const TickInfo&) { std::this_thread::sleep_for(milliseconds(100)); });
  EXPECT_FALSE(run.run({{spec_of("t"), &task}}).hang.has_value());
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace hil::executive
