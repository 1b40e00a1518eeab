#pragma once
// How often each exception of the protocol was sent or received.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace hil::io::modbus {

/// Indexed by code; the protocol defines 1 to 11.
using ExceptionCounts = std::array<std::uint64_t, 12>;

/// Threads: any.
class ExceptionTally {
 public:
  /// `code`: 1 to 11.
  void add(std::size_t code) noexcept {
    if (code < counts_.size()) counts_[code].fetch_add(1, std::memory_order_relaxed);
  }
  ExceptionCounts counts() const noexcept {
    ExceptionCounts counts{};
    for (std::size_t code = 0; code < counts.size(); ++code)
      counts[code] = counts_[code].load(std::memory_order_relaxed);
    return counts;
  }

 private:
  std::array<std::atomic<std::uint64_t>, std::tuple_size_v<ExceptionCounts>> counts_{};
};

}  // namespace hil::io::modbus
