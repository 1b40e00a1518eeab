// The tick neither allocates nor frees memory.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "runtime/executive/executive.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using test::spec_of;

/// Prevents the compiler from removing an allocation whose memory is unused.
void* volatile escaped = nullptr;

/// Its thread is guarded from its run `from` up to its run `to`.
class GuardedTask final : public Task {
 public:
  GuardedTask(std::uint64_t from, std::uint64_t to, bool allocates = false)
      : from_(from), to_(to), allocates_(allocates) {}
  void step(const TickInfo& tick) noexcept override {
    if (tick.run == from_) allocation_guard::enter_tick();
    if (tick.run == to_) allocation_guard::leave_tick();
    if (allocates_ && tick.run == (from_ + to_) / 2) {
      escaped = std::malloc(100);
      std::free(escaped);
      // NOLINTNEXTLINE(bugprone-unhandled-exception-at-new): it ends the test
      auto* const text = new std::string(100, 'x');  // allocates here and in the standard library
      escaped = text;
      delete text;
    }
    if (tick.run >= from_ && tick.run < to_) guarded_runs_.fetch_add(1);
  }
  std::uint64_t guarded_runs() const { return guarded_runs_; }

 private:
  const std::uint64_t from_, to_;
  const bool allocates_;
  std::atomic<std::uint64_t> guarded_runs_{0};
};

/// Ten tasks, four of them on two further threads, with misses and overruns: all heap traffic between the
/// first guarded run and the last is counted, that of the executive included.
std::uint64_t traffic_of_ten_tasks(Clock& clock, bool one_allocates) {
  ExecutiveOptions options;
  options.clock = &clock;
  options.duration_ticks = 400;
  options.catch_up_ticks = 400;
  std::vector<std::unique_ptr<GuardedTask>> tasks;
  Executive executive(options);
  for (int i = 0; i < 6; ++i) {
    tasks.push_back(std::make_unique<GuardedTask>(100, 380, one_allocates && i == 3));
    TaskSpec spec = spec_of(("base" + std::to_string(i)).c_str());
    spec.deadline_ns = i == 0 ? 1 : 0;  // misses in every tick of a real clock
    executive.add_task(spec, *tasks.back());
  }
  for (int i = 0; i < 4; ++i) {
    tasks.push_back(std::make_unique<GuardedTask>(20, 70));
    TaskSpec spec = spec_of(("threaded" + std::to_string(i)).c_str(), 5, i < 2 ? "first" : "second");
    spec.overrun = i % 2 == 0 ? OverrunPolicy::skip : OverrunPolicy::queue;
    executive.add_task(spec, *tasks.back());
  }
  allocation_guard::reset();
  const std::atomic<bool> stop{false};
  const RunResult result = executive.run(stop);
  allocation_guard::leave_tick();
  for (int i = 0; i < 6; ++i)
    EXPECT_GT(tasks[i]->guarded_runs(), 200U);
  for (int i = 6; i < 10; ++i)
    EXPECT_GT(tasks[i]->guarded_runs(), 30U);
  if (!clock.is_virtual()) {
    EXPECT_GT(result.tasks[0].deadline_misses, 0U);
  }
  return allocation_guard::seen().total();
}

TEST(HeapTraffic, IsAbsentInTheTickInRealTime) {
  MonotonicClock clock;
  EXPECT_EQ(traffic_of_ten_tasks(clock, false), 0U);
}

TEST(HeapTraffic, IsAbsentInTheTickUnderTheVirtualClock) {
  VirtualClock clock;
  EXPECT_EQ(traffic_of_ten_tasks(clock, false), 0U);
}

TEST(HeapTraffic, OfATaskIsDetected) {
  MonotonicClock clock;
  EXPECT_EQ(traffic_of_ten_tasks(clock, true), 6U);
}

}  // namespace
}  // namespace hil::executive
