#pragma once
// A material: the optical properties of a surface. Registered once (Database::add_material), then named by
// the rows of entities; it never changes. Sensors that are simulated with rays and cones read `reflectance`
// and `retro_gain`; images read `retro_gain` and all others but `reflectance`.
//
// Colours are linear (not gamma-encoded) and have the primaries of sRGB: red, green, blue.
//
// Threads: pure functions and plain data; any thread.

#include <glm/ext/vector_double3.hpp>

#include <rtstdb/result.hpp>

namespace rtstdb {

/// Every property has a default. Callers name the properties that they set (Material{.reflectance = 0.2}),
/// and a log holds those that differ from their defaults. So a property can be added without a change of
/// callers, of existing logs or of their format.
struct Material {
  /// Share of the incident light of a laser scanner that a matt (Lambertian) surface scatters: 0 to 1.
  double reflectance = 1.0;
  /// A retro-reflector returns, at any angle of incidence, this many times as much light toward the source as
  /// a matt surface of the same reflectance does at normal incidence: 1 to max_retro_gain. 0: the surface is
  /// not a retro-reflector. In images a retro-reflector does not scatter the share `base_color` of the light
  /// but returns it, with equal radiance, into the cone of the solid angle pi / retro_gain around the
  /// direction to the source. So its radiance there is retro_gain times that of a matt surface.
  double retro_gain = 0.0;
  /// Share of the light that a matt surface scatters, and the colour of what a metal reflects: 0 to 1 each.
  glm::dvec3 base_color{0.8};
  /// 0 to 1. 0: not a metal; 1: a metal; between: a mixture, of which this share scatters light as the metal
  /// alone and the rest as the surface with metallic 0 alone.
  double metallic = 0.0;
  /// 0 to 1. 0: a mirror; 1: the roughest surface. The width of the microfacet distribution (GGX, alpha) is
  /// its square. Below 0.03 an image shows a smooth mirror.
  double roughness = 1.0;
  /// Luminance of the light that the surface emits, the same in all directions: 0 to max_luminance_cdpm2
  /// each. Equal channels (L, L, L) have the luminance L.
  glm::dvec3 emission_cdpm2{0.0};
  /// Share of the light, of what the surface does not reflect, that passes through it instead of being
  /// scattered: 0 to 1.
  double transmission = 0.0;
  double refractive_index = 1.5;  ///< of what is behind the surface: 1 to max_refractive_index

  bool is_retro_reflector() const noexcept { return retro_gain != 0.0; }
  friend bool operator==(const Material&, const Material&) = default;
};

/// Errors: bad_input for a property outside its range or not finite; the message names the property, its
/// value and the range.
Result<void> validate_material(const Material& material);

}  // namespace rtstdb
