#pragma once
// The fixed limits of the database. Limits that the caller chooses are in DatabaseOptions.

#include <cstddef>
#include <cstdint>

namespace rtstdb {

inline constexpr std::uint32_t max_entities = 1u << 20;
inline constexpr std::uint32_t max_geometries = 1u << 16;
/// Over all geometries: a leaf of an acceleration structure refers to a triangle by 26 bits.
inline constexpr std::uint32_t max_triangles_total = 1u << 26;
/// Limit of one polygon in a mesh file. Triangulation takes time up to the third power of this number.
inline constexpr std::uint32_t max_polygon_corners = 4096;
inline constexpr std::uint64_t max_field_bytes = std::uint64_t{1} << 34;  ///< FieldOptions::max_bytes
inline constexpr std::uint32_t max_retained_shapes = 256;  ///< GeometryOptions::retained_shapes
/// The default material included.
inline constexpr std::uint32_t max_materials = 4096;
inline constexpr double max_retro_gain = 1e6;        ///< Material::retro_gain
inline constexpr double max_refractive_index = 4.0;  ///< Material::refractive_index
inline constexpr std::uint32_t max_lights = 4096;
/// Limit of each channel of Material::emission_cdpm2 and of a sky (Light).
inline constexpr double max_luminance_cdpm2 = 1e10;
/// Members of Light.
inline constexpr double max_light_color = 1e3;
inline constexpr double max_illuminance_lx = 1e7;
inline constexpr double max_intensity_cd = 1e10;
inline constexpr double max_angular_diameter_rad = 0.2;
/// Limits of Light::outer_angle_rad. The larger one is pi rounded up, so that 180 degrees are allowed.
inline constexpr double min_spot_angle_rad = 0.01;
inline constexpr double max_spot_angle_rad = 3.1416;
inline constexpr std::uint32_t max_rays_per_query = 1u << 22;
inline constexpr std::uint32_t max_hits_per_ray = 16;
/// Capacity times hits_per_ray of one ray query.
inline constexpr std::uint32_t max_hits_per_query = 1u << 24;
inline constexpr std::uint32_t max_regions_per_query = (1u << 16) - 1;
inline constexpr std::uint32_t max_ids_per_region = 1u << 16;
inline constexpr std::uint32_t max_points_per_query = 1u << 20;
inline constexpr std::uint32_t max_neighbors = 32;
inline constexpr std::uint32_t max_cones_per_query = 1u << 20;
inline constexpr std::uint32_t max_returns_per_cone = 8;
/// ConeQueryOptions::fractions: the nearest entities of a cone among which the beam is distributed.
inline constexpr std::uint32_t max_entities_per_beam = 16;
inline constexpr std::uint32_t max_contact_searches = 1u << 16;
inline constexpr std::uint32_t max_contact_pairs = 1u << 16;       ///< ContactQueryOptions::pairs_per_search
inline constexpr std::uint32_t max_contact_candidates = 1u << 20;  ///< ContactQueryOptions::max_candidates
inline constexpr std::uint32_t max_convex_part_points =
    1024;  ///< of a part of GeometryOptions::convex_parts_m
/// Bounds of a distance of convex bodies are apart by at most this share of the diagonal of the smaller body,
/// where single precision resolves that (contact.hpp).
inline constexpr double contact_precision = 2e-5;
/// The largest deviations of GeometryOptions::convex_parts_m and of GeometryOptions::solid from the mesh, as
/// shares of the diagonal of the mesh's box.
inline constexpr double convex_parts_tolerance = 0.05;
inline constexpr double solid_tolerance = 0.02;
/// The largest ContactQueryOptions::max_surface_triangles, and the default of max_surface_pairs.
inline constexpr std::uint32_t max_contact_surface_triangles = 1u << 23;
inline constexpr std::uint32_t default_contact_surface_pairs = 1u << 12;
inline constexpr double max_contact_margin_m = 1e3;                   ///< ContactSearch::margin_m
inline constexpr std::int64_t max_impact_window_ns = 10'000'000'000;  ///< ImpactSearch::window
inline constexpr std::uint32_t max_impact_steps = 4096;               ///< UndecidedReason::steps
inline constexpr double min_impact_tolerance_m = 1e-6;                ///< ImpactSearch::tolerance_m
inline constexpr std::uint32_t max_images_per_query = 1u << 16;
inline constexpr std::uint32_t max_image_side = 1u << 14;              ///< ImageQueryOptions: width, height
inline constexpr std::uint32_t max_image_pixels_per_query = 1u << 26;  ///< of all images of a batch
inline constexpr std::uint32_t max_image_samples = 1u << 16;           ///< samples_per_pixel
inline constexpr std::uint32_t max_image_bounces = 64;
inline constexpr std::uint32_t min_shadow_map_side = 64, max_shadow_map_side = 1u << 13;
inline constexpr std::uint32_t max_shadow_maps = 64;      ///< of an image
inline constexpr std::uint32_t max_emitter_points = 256;  ///< ImageQueryOptions::emitter_points
inline constexpr std::uint32_t max_lobe_rays = 256;       ///< ImageQueryOptions::lobe_rays
inline constexpr double min_image_half_tangent = 1e-6, max_image_half_tangent = 1e3;  ///< Camera
inline constexpr double min_image_near_m = 1e-4, max_image_near_m = 1e4;              ///< Camera::near_m
inline constexpr std::uint32_t image_tile_px = 16;  ///< side of a tile (Image::missing_tiles)
/// Entities that name a light or whose material emits light. A mesh of such an entity may have 65,536
/// triangles, and all such meshes together.
inline constexpr std::uint32_t max_lights_per_image = 1024;
inline constexpr std::uint32_t max_fixed_lights = 16;
/// A closed mesh is convex if every point of its surface is within this share of the diagonal of its box, or
/// within hull_tolerance_ulp, of the surface of the hull of its corners.
inline constexpr double convex_tolerance = 1e-5;
/// Least thickness of a hull that is not flat, in units in the last place (ulp) of single precision at the
/// body's largest coordinate. Corners of a mesh within half of it of the hull of the others may be omitted.
inline constexpr double hull_tolerance_ulp = 4.0;
inline constexpr std::uint32_t max_convex_parts = 256;  ///< GeometryInfo::convex_parts
/// Larger meshes are not examined: they have no convex parts.
inline constexpr std::uint32_t max_convex_triangles = 1u << 20;
/// Cells along each axis of a brick (field.hpp).
inline constexpr std::uint32_t field_cells_per_brick = 5;
/// FieldSign::ray_ratio: rays from each vertex; the least share of them that hit a triangle from behind where
/// a vertex is inside.
inline constexpr std::uint32_t field_sign_rays = 64;
inline constexpr double field_inside_ratio = 0.75;
inline constexpr std::uint32_t max_standing_events = 1u << 22;
/// Row changes in the queue from commits to the thread that evaluates standing queries. When it is full, that
/// thread skips versions (EventCause::gap).
inline constexpr std::uint32_t standing_queue_capacity = 1u << 14;
inline constexpr std::uint32_t max_queue_capacity = 1u << 16;
inline constexpr std::uint32_t max_retained_changes = 1u << 26;
/// Limits of positions, mesh coordinates, extents and velocities, beyond which input is refused. Single
/// precision resolves better than 8 mm within max_coordinate_m. A scale or a long motion can move an entity
/// beyond it; queries then find the entity as precisely as single precision represents its coordinates.
inline constexpr double max_coordinate_m = 1e5;
inline constexpr double max_speed_mps = 1e5;
inline constexpr double max_angular_rate_radps = 1e4;
inline constexpr double max_scale = 1e5;
inline constexpr double min_scale = 1e-6;
/// A ray through the middle of a body hits it if the distance is at most this many times the body's thickness
/// (single precision). The distance is the largest of: from the world's origin to the body, from the ray's
/// origin to the body, and the body's length. Beyond this ratio rays can miss: at 1e7 some do, at 1e8 most.
/// Thinner bodies are not refused.
inline constexpr double max_distance_per_thickness = 1e6;
/// Largest span of the times of one batch (the elements of one query in one transaction). Beyond it, the
/// bounds that enclose an entity's motion are too large to be useful.
inline constexpr std::int64_t max_query_window_ns = 1'000'000'000;
/// World times are between minus and plus this (146 years), so that no difference of two of them overflows.
/// The empty world, version 0, holds from minus this on.
inline constexpr std::int64_t max_world_time_ns = (std::int64_t{1} << 62) - 1;
inline constexpr std::uint8_t max_importance = 7;  ///< Terms::importance
inline constexpr std::size_t max_reservations = 32;
/// Share of the engine's time below which all reservations together stay. The rest covers costs that were
/// measured too low, and transactions without a reservation.
inline constexpr double max_reserved_share = 0.8;
/// Limit of the period and the deadline of a reservation: one hour.
inline constexpr std::int64_t max_reservation_period_ns = 3'600'000'000'000;
/// Limit of DatabaseOptions::chunk, and of DurabilityOptions::flush_interval: one hour.
inline constexpr std::int64_t max_option_duration_ns = 3'600'000'000'000;

}  // namespace rtstdb
