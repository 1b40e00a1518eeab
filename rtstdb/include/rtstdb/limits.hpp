#pragma once
// Every fixed limit of the database in one place. Limits that a caller chooses are in DatabaseOptions.

#include <cstddef>
#include <cstdint>

namespace rtstdb {

inline constexpr std::uint32_t max_entities = 1u << 20;
inline constexpr std::uint32_t max_geometries = 1u << 16;
/// Leaf references hold 26 bits of triangle index.
inline constexpr std::uint32_t max_triangles_total = 1u << 26;
/// Of one polygon in a mesh file: to cut it takes up to the third power of their number.
inline constexpr std::uint32_t max_polygon_corners = 4096;
inline constexpr std::uint32_t max_kept_shapes = 256;
inline constexpr std::uint32_t max_rays_per_query = 1u << 22;
inline constexpr std::uint32_t max_hits_per_ray = 16;
/// Rays times hits_per_ray of one query.
inline constexpr std::uint32_t max_hits_per_query = 1u << 24;
inline constexpr std::uint32_t max_regions_per_query = (1u << 16) - 1;
inline constexpr std::uint32_t max_ids_per_region = 1u << 16;
inline constexpr std::uint32_t max_points_per_query = 1u << 20;
inline constexpr std::uint32_t max_neighbors = 32;
inline constexpr std::uint32_t max_standing_events = 1u << 22;
inline constexpr std::uint32_t max_queue_capacity = 1u << 16;
inline constexpr std::uint32_t max_retained_changes = 1u << 26;
/// Positions, corners of meshes, extents and velocities beyond these are refused: single precision keeps better than 8 mm
/// inside them. What lies beyond them all the same, since a scale stretched it or it has moved for long, is found as precisely as
/// its coordinates are.
inline constexpr double max_coordinate_m = 1e5;
inline constexpr double max_speed_mps = 1e5;
inline constexpr double max_angular_rate_radps = 1e4;
inline constexpr double max_scale = 1e5;
inline constexpr double min_scale = 1e-6;
/// The largest ratio of distance to thickness up to which a ray through the middle of a body hits it (single
/// precision). The distance is the largest of: the body's from the world's origin, the body's from the ray's
/// origin, the body's length. Beyond this ratio rays may miss: at 1e7 some, at 1e8 most. Thinner bodies are
/// not refused.
inline constexpr double max_distance_per_thickness = 1e6;
/// The largest span of the times of one batch, which is the elements of one query in one transaction. Beyond
/// it motion bounds become too large to be useful.
inline constexpr std::int64_t max_query_window_ns = 1'000'000'000;
/// World times lie within +- this (146 years), so that no difference of two of them overflows. The empty
/// database holds from its negative on.
inline constexpr std::int64_t max_world_time_ns = (std::int64_t{1} << 62) - 1;
inline constexpr std::uint8_t max_importance = 7;
inline constexpr std::size_t max_reservations = 32;
/// Of periods and deadlines: an hour.
inline constexpr std::int64_t max_reservation_period_ns = 3'600'000'000'000;
/// Of DatabaseOptions::chunk and spin, and of DurabilityOptions::flush_interval: an hour.
inline constexpr std::int64_t max_option_duration_ns = 3'600'000'000'000;

}  // namespace rtstdb
