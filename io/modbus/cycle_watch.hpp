#pragma once
// Detects that cycles make no progress: a release is waiting and no cycle has ended since.
//
// Threads: release from the tick's thread, end_cycle from the cycle's, waits_since from any thread.

#include <atomic>
#include <cstdint>
#include <optional>

#include "io/device.hpp"

namespace hil::io::modbus {

class CycleWatch {
 public:
  /// Outputs were released. Neither allocates nor blocks.
  void release(RunTimeNs tick_ns) noexcept {
    const std::uint64_t ended = ended_.load(relaxed);
    if (has_release_.load(relaxed) && seen_.load(relaxed) == ended) return;
    since_ns_.store(tick_ns, relaxed);
    seen_.store(ended, relaxed);
    has_release_.store(true, relaxed);
  }
  /// Notes that a cycle ended, with or without success.
  void end_cycle() noexcept { ended_.fetch_add(1, relaxed); }
  /// The time of the first release after the last cycle ended; empty: none is waiting.
  std::optional<RunTimeNs> waits_since() const noexcept {
    if (!has_release_.load(relaxed) || seen_.load(relaxed) != ended_.load(relaxed)) return std::nullopt;
    return since_ns_.load(relaxed);
  }

 private:
  static constexpr auto relaxed = std::memory_order_relaxed;

  std::atomic<std::uint64_t> ended_{0};
  std::atomic<std::uint64_t> seen_{0};  ///< ended_ at the waiting release
  std::atomic<RunTimeNs> since_ns_{0};
  std::atomic<bool> has_release_{false};
};

}  // namespace hil::io::modbus
