#include "runtime/executive/watchdog.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "runtime/executive/clock.hpp"

namespace hil::executive {

std::int64_t effective_timeout_ns(const WatchdogOptions& options, std::int64_t base_period_ns) noexcept {
  constexpr std::int64_t shortest_ns = 100'000'000;
  return options.timeout_ns > 0 ? options.timeout_ns : std::max(shortest_ns, 50 * base_period_ns);
}

Watchdog::Watchdog(WatchdogOptions options, std::int64_t timeout_ns,
                   const std::atomic<std::uint64_t>& ticks_begun)
    : options_(std::move(options)),
      timeout_ns_(timeout_ns),
      ticks_begun_(ticks_begun),
      thread_([this] { watch(); }) {}

Watchdog::~Watchdog() {
  stop();
}

std::optional<Hang> Watchdog::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
  return hang_;
}

void Watchdog::watch() {
  pthread_setname_np(pthread_self(), "hil-watchdog");
  const std::int64_t reading_cost_ns = std::max<std::int64_t>(timeout_ns_ / 8, 1);
  const MonotonicClock clock;
  std::uint64_t seen_ticks = ticks_begun_.load(std::memory_order_relaxed);
  std::int64_t silent_ns = 0;
  std::int64_t looked_ns = clock.now_ns();
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, std::chrono::nanoseconds(reading_cost_ns), [this] { return stopping_; })) {
    const std::int64_t now_ns = clock.now_ns();
    const std::uint64_t ticks = ticks_begun_.load(std::memory_order_relaxed);
    silent_ns =
        ticks > 0 && ticks == seen_ticks ? silent_ns + std::min(now_ns - looked_ns, 2 * reading_cost_ns) : 0;
    seen_ticks = ticks;
    looked_ns = now_ns;
    if (silent_ns < timeout_ns_) continue;
    hang_ = Hang{ticks, silent_ns};
    lock.unlock();
    if (options_.safe_state) options_.safe_state();
    return;
  }
}

}  // namespace hil::executive
