// A minute of the crossing in real time under SCHED_FIFO, compared with cyclictest, which runs at the same
// time.

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <future>
#include <string>
#include <thread>

#include "bench/executive/cyclictest.hpp"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

constexpr std::uint64_t minute_ms = 60'000;
constexpr int priority = 60;  // the scenario's

TEST(CrossingMinute, HasNoMoreLateWakeUpsThanCyclictest) {
  const Folder folder;
  // cyclictest starts when the run has opened, which takes about one second.
  std::future<bench::WakeupLatency> in_parallel = std::async(std::launch::async, [] {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    return bench::run_cyclictest({.ticks = minute_ms, .period_us = 1'000, .fifo_priority = priority});
  });
  const Ended run = Program(hil({"run", crossing(), "--duration", "60 s", "--out", folder / "out"}))
                        .wait(std::chrono::seconds(120));
  const bench::WakeupLatency cyclictest = in_parallel.get();
  std::printf("%s", run.output.c_str());
  EXPECT_EQ(run.code, 0) << run.output << run.errors;

  const auto report = read_report(folder / "out");
  ASSERT_EQ(report["realtime"]["scheduler"], "SCHED_FIFO");
  EXPECT_EQ(report["ticks"].get<std::uint64_t>() + report["skipped_ticks"].get<std::uint64_t>(), minute_ms);
  // CPU time that the host takes without reporting it is counted as work. cyclictest, which has no work,
  // shows how often that happens.
  std::uint64_t by_own_work = 0;
  for (const auto& task : report["tasks"]) {
    for (const auto& miss : task["misses"]) {
      if (miss["cause"] != "own work") continue;
      ++by_own_work;
      EXPECT_LE(miss["lateness_ns"].get<double>() * 1e-3, cyclictest.max_us) << task["name"] << ": " << miss;
    }
  }
  std::printf("%llu misses by own work; cyclictest woke %llu times more than 1 ms late, %.1f us at most\n",
              static_cast<unsigned long long>(by_own_work),
              static_cast<unsigned long long>(cyclictest.beyond_1_ms), cyclictest.max_us);
  EXPECT_LE(by_own_work, cyclictest.beyond_1_ms);
  const auto& base_task = report["tasks"][0];
  const double p99_us = base_task["wake_latency_ns"]["p99"].get<double>() * 1e-3;
  std::printf("p99 wake-up latency of %s: %.1f us; cyclictest: %.1f us\n",
              base_task["name"].get<std::string>().c_str(), p99_us, cyclictest.p99_us);
  EXPECT_LE(p99_us, 1.5 * cyclictest.p99_us);
}

}  // namespace
}  // namespace hil::scenario_test
