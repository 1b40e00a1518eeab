#pragma once
// Which exceptions of the protocol were sent or received, how often, and the first request of each.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "io/modbus/register_map.hpp"

namespace hil::io::modbus {

/// Indexed by code; the protocol defines 1 to 11.
using ExceptionCounts = std::array<std::uint64_t, 12>;
using FirstRefusedRequests = std::array<std::optional<RequestRange>, 12>;

/// "illegal data address". `code`: 1 to 11.
std::string_view exception_name(std::size_t code) noexcept;

/// Threads: one adds, any reads.
class ExceptionTally {
 public:
  /// `code`: 1 to 11; others are not counted. `range`: of the refused request; empty if it has none.
  void add(std::size_t code, const std::optional<RequestRange>& range) noexcept;
  ExceptionCounts counts() const noexcept;
  /// The range of the first request with each code; empty: there was none, or it had no range.
  FirstRefusedRequests first_requests() const noexcept;

 private:
  std::array<std::atomic<std::uint64_t>, std::tuple_size_v<ExceptionCounts>> counts_{};
  std::array<std::atomic<std::uint64_t>, std::tuple_size_v<ExceptionCounts>> first_{};  ///< packed; 0: none
};

}  // namespace hil::io::modbus
