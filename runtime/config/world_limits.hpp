#pragma once
// The database's own limits (rtstdb/limits.hpp), which this room can not see: beyond them single precision is too
// coarse for a scene.

namespace hil::config {

inline constexpr double farthest_m = 1e5;
inline constexpr double fastest_mps = 1e5;
inline constexpr double fastest_turn_radps = 1e4;
inline constexpr double smallest_scale = 1e-6;
inline constexpr double largest_scale = 1e5;

}  // namespace hil::config
