#pragma once
// A light: what illuminates images. Registered once (Database::add_light), then named by the rows of
// entities; it never changes. So a light moves with its entity, which may have a geometry too. Only images
// read lights.
//
// Colours are linear and have the primaries of sRGB. Each channel of a light is its colour times its
// photometric value, so a white light, (1, 1, 1), has exactly that value.
//
// Frames: "entity" is the frame of the entity that names the light (entity.hpp). The scale of the entity does
// not change the light.
//
// Threads: pure functions and plain data; any thread.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>

#include <rtstdb/result.hpp>

namespace rtstdb {

enum class LightKind : std::uint8_t {
  directional,  ///< from infinitely far away, along +x of the entity: the sun
  point,        ///< from p_m, equal in all directions
  spot,         ///< from p_m, around +x of the entity
  sky,          ///< from all around, by direction in the entity's frame, z up
};
const char* to_string(LightKind kind) noexcept;

/// A property that its kind does not use has its default.
struct Light {
  LightKind kind = LightKind::point;
  /// All kinds but sky: 0 to max_light_color each, and not all 0.
  glm::dvec3 color{1.0};
  /// point and spot: position in the entity frame, unscaled; each coordinate at most max_coordinate_m. In a
  /// body that is lit from within, put it in front of the surface, which hides it otherwise.
  glm::dvec3 p_m{0.0};
  /// directional: on a surface perpendicular to the light. Above 0, at most max_illuminance_lx.
  double illuminance_lx = 0.0;
  /// point, and spot within its inner angle. Above 0, at most max_intensity_cd.
  double intensity_cd = 0.0;
  /// spot: full angles of the cones with full intensity and with any intensity; 0 <= inner <= outer, and
  /// min_spot_angle_rad <= outer <= max_spot_angle_rad. At the angle a to +x the intensity is multiplied by
  ///     t * t * (3 - 2 * t)  with
  ///     t = clamp((cos(a) - cos(outer / 2)) / (cos(inner / 2) - cos(outer / 2)), 0, 1)
  /// or, where inner = outer, by 1 for a <= outer / 2 and by 0 beyond.
  double inner_angle_rad = 0.0;
  double outer_angle_rad = 0.0;
  /// directional: of the disc that the light comes from, whose luminance is uniform. 0 to
  /// max_angular_diameter_rad; 0: shadows are sharp.
  double angular_diameter_rad = 0.0;
  /// sky: luminance of each channel, 0 to max_luminance_cdpm2 each. With s = sin(elevation) of a direction
  /// above the x-y plane of the entity, it is (1 - s) * horizon + s * zenith where s >= 0, else ground.
  glm::dvec3 zenith_cdpm2{0.0};
  glm::dvec3 horizon_cdpm2{0.0};
  glm::dvec3 ground_cdpm2{0.0};

  friend bool operator==(const Light&, const Light&) = default;
};

/// Errors: bad_input for a property outside its range or not finite (the message names the property, its
/// value and the range), for one that the kind does not use and that differs from its default, and for a kind
/// that is not one of the enumerators.
Result<void> validate_light(const Light& light);

}  // namespace rtstdb
