#pragma once
// Detects that the base thread makes no more ticks, and then sets the outputs to their safe state, once. It
// is an ordinary thread and needs some CPU time that the base thread does not use. It counts only time in
// which it was awake itself, so a process that was stopped and continued is not a hang.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "runtime/executive/result.hpp"

namespace hil::executive {

struct WatchdogOptions {
  /// 0: the longer of 100 ms and 50 base periods.
  std::int64_t timeout_ns = 0;
  /// Called on the watchdog's thread, at most once per run, while the base thread may be anywhere. May block.
  std::function<void()> safe_state;
};

std::int64_t effective_timeout_ns(const WatchdogOptions& options, std::int64_t base_period_ns) noexcept;

class Watchdog {
 public:
  /// Watches from the first tick on. `ticks_begun` grows with each tick and must outlive the watchdog.
  Watchdog(WatchdogOptions options, std::int64_t timeout_ns, const std::atomic<std::uint64_t>& ticks_begun);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// Stops watching, after waiting for a running safe_state. Returns the hang, if there was one.
  std::optional<Hang> stop();

 private:
  void watch();

  const WatchdogOptions options_;
  const std::int64_t timeout_ns_;
  const std::atomic<std::uint64_t>& ticks_begun_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::optional<Hang> hang_;
  std::thread thread_;
};

}  // namespace hil::executive
