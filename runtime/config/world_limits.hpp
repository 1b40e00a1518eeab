#pragma once
// The database's own limits (rtstdb/limits.hpp, rtstdb/durability.hpp), which this library can not see.

#include <cstdint>

namespace hil::config {

// Single precision is too coarse beyond these.
inline constexpr int max_added_materials = 4095;  ///< without the default material
inline constexpr double max_retro_gain = 1e6;
inline constexpr double max_coordinate_m = 1e5;
inline constexpr double max_speed_mps = 1e5;
inline constexpr double max_angular_rate_radps = 1e4;
inline constexpr double min_scale = 1e-6;
inline constexpr double max_scale = 1e5;

inline constexpr std::int64_t max_field_bytes = std::int64_t{1} << 34;

inline constexpr std::int64_t min_log_ring_bytes = 4096;
inline constexpr std::int64_t max_log_ring_bytes = std::int64_t{1} << 30;

}  // namespace hil::config
