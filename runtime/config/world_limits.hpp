#pragma once
// The database's own limits (rtstdb/limits.hpp, rtstdb/durability.hpp), which this library can not see.

#include <cstdint>

namespace hil::config {

// Single precision is too coarse beyond these.
inline constexpr int max_added_materials = 4095;  ///< without the default material
inline constexpr double max_retro_gain = 1e6;
inline constexpr double max_refractive_index = 4.0;
inline constexpr int max_lights = 4096;
inline constexpr double max_luminance_cdpm2 = 1e10;
inline constexpr double max_light_color = 1e3;
inline constexpr double max_illuminance_lx = 1e7;
inline constexpr double max_intensity_cd = 1e10;
inline constexpr double max_angular_diameter_rad = 0.2;
inline constexpr double min_spot_angle_rad = 0.01;
inline constexpr double max_spot_angle_rad = 3.1416;
inline constexpr double max_coordinate_m = 1e5;
inline constexpr double max_speed_mps = 1e5;
inline constexpr double max_angular_rate_radps = 1e4;
inline constexpr double min_scale = 1e-6;
inline constexpr double max_scale = 1e5;

inline constexpr std::int64_t max_field_bytes = std::int64_t{1} << 34;

inline constexpr std::int64_t min_log_ring_bytes = 4096;
inline constexpr std::int64_t max_log_ring_bytes = std::int64_t{1} << 30;

}  // namespace hil::config
