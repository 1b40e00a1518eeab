#pragma once

#include <cstdint>

namespace rtstdb::gpu {

/// The signed difference between two values of a counter that has `valid_bits` (1 to 64) bits and may have
/// wrapped in between. Its magnitude must be below half of the counter's range. Higher bits of the values are
/// ignored.
constexpr std::int64_t timestamp_difference(std::uint64_t from, std::uint64_t to, std::uint32_t valid_bits) {
  const std::uint32_t unused = 64 - valid_bits;
  return static_cast<std::int64_t>((to - from) << unused) >> unused;
}

}  // namespace rtstdb::gpu
