#pragma once

#include <cstdint>

namespace rtstdb::gpu {

/// The step from one value of a counter of `valid_bits` (1 to 64) bits to another, which is less than half of
/// its range away; the counter may have wrapped in between. Bits above are ignored.
constexpr std::int64_t timestamp_difference(std::uint64_t from, std::uint64_t to, std::uint32_t valid_bits) {
  const std::uint32_t unused = 64 - valid_bits;
  return static_cast<std::int64_t>((to - from) << unused) >> unused;
}

}  // namespace rtstdb::gpu
