#pragma once
// The database's own limits (rtstdb/limits.hpp, rtstdb/durability.hpp), which this library can not see.

#include <cstdint>

namespace hil::config {

// Beyond them single precision is too coarse for a scene.

inline constexpr double farthest_m = 1e5;
inline constexpr double fastest_mps = 1e5;
inline constexpr double fastest_turn_radps = 1e4;
inline constexpr double smallest_scale = 1e-6;
inline constexpr double largest_scale = 1e5;

inline constexpr std::int64_t min_log_ring_bytes = 4096;
inline constexpr std::int64_t max_log_ring_bytes = std::int64_t{1} << 30;

}  // namespace hil::config
