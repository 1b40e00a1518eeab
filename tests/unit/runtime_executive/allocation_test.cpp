// No heap traffic in the tick, and a guard that is known to see it.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "runtime/executive/executive.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_executive/fake_time.hpp"

namespace hil::executive {
namespace {

using testing::spec_of;

/// Prevents the compiler from removing an allocation whose memory is unused.
void* volatile escaped = nullptr;

template <typename Action>
allocation_guard::Traffic traffic_of(Action action) {
  allocation_guard::reset();
  allocation_guard::enter_tick();
  action();
  allocation_guard::leave_tick();
  return allocation_guard::seen();
}

TEST(AllocationGuard, SeesEveryKindOfAllocation) {
  const std::uint64_t aligned_count = allocation_guard::sees_aligned_allocations() ? 1 : 0;
  const auto free_it = [] { std::free(escaped); };
  EXPECT_EQ(traffic_of([] { escaped = std::malloc(10); }).allocations, 1U);
  EXPECT_EQ(traffic_of(free_it).frees, 1U);
  EXPECT_GE(traffic_of([] { escaped = std::realloc(std::calloc(3, 7), 50); }).allocations, 2U);
  free_it();
  EXPECT_EQ(traffic_of([] { escaped = std::aligned_alloc(64, 128); }).allocations, aligned_count);
  free_it();
  void* aligned = nullptr;
  EXPECT_EQ(traffic_of([&] { EXPECT_EQ(posix_memalign(&aligned, 256, 100), 0); }).allocations, aligned_count);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(aligned) % 256, 0U);
  std::free(aligned);
  const auto made = traffic_of([] {
    auto number = std::make_unique<int>(1);
    escaped = number.get();
    auto text = std::make_unique<std::string>(100, 'x');  // the library's own code allocates too
    escaped = text.get();
  });
  EXPECT_EQ(made.allocations, 3U);
  EXPECT_EQ(made.frees, 3U);
}

TEST(AllocationGuard, LooksOnlyAtThreadsInTheTick) {
  allocation_guard::reset();
  escaped = std::malloc(10);
  std::free(escaped);
  std::thread other([] {
    escaped = std::malloc(20);
    std::free(escaped);
  });
  other.join();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_EQ(traffic_of([] { std::free(nullptr); }).total(), 0U);
}

TEST(AllocationGuardDeathTest, CanEndTheProgramAtTheSpot) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(
      {
        allocation_guard::abort_on_traffic(true);
        allocation_guard::enter_tick();
        escaped = std::malloc(10);
      },
      "heap traffic in the tick");
}

/// Declares its thread in the tick from its run `from` on, to its run `to`.
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
    }
    if (tick.run >= from_ && tick.run < to_) guarded_runs_.fetch_add(1);
  }
  std::uint64_t guarded_runs() const { return guarded_runs_; }

 private:
  const std::uint64_t from_, to_;
  const bool allocates_;
  std::atomic<std::uint64_t> guarded_runs_{0};
};

/// Ten tasks, four of them on two threads of their own, misses and overruns among them: everything between
/// the first guarded run and the last is counted, the executive's own work included.
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
    TaskSpec spec = spec_of(("own" + std::to_string(i)).c_str(), 5, i < 2 ? "first" : "second");
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

TEST(Allocation, NoneInTheTickInRealTime) {
  MonotonicClock clock;
  EXPECT_EQ(traffic_of_ten_tasks(clock, false), 0U);
}

TEST(Allocation, NoneInTheTickUnderTheVirtualClock) {
  VirtualClock clock;
  EXPECT_EQ(traffic_of_ten_tasks(clock, false), 0U);
}

TEST(Allocation, ATaskThatAllocatesIsCaught) {
  MonotonicClock clock;
  EXPECT_EQ(traffic_of_ten_tasks(clock, true), 2U);
}

}  // namespace
}  // namespace hil::executive
