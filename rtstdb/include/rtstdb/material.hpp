#pragma once
// A material: the optical properties of a surface. Registered once (Database::add_material), then named by
// the rows of entities; it never changes. Sensors that are simulated with rays and cones read it.
//
// Threads: pure functions and plain data; any thread.

#include <rtstdb/result.hpp>

namespace rtstdb {

/// Every property has a default. Callers name the properties that they set (Material{.reflectance = 0.2}),
/// and a log holds those that differ from their defaults. So a property can be added without a change of
/// callers, of existing logs or of their format.
struct Material {
  /// Share of the incident light that a matt (Lambertian) surface scatters: 0 to 1.
  double reflectance = 1.0;
  /// A retro-reflector returns, at any angle of incidence, this many times as much light toward the source as
  /// a matt surface of the same reflectance does at normal incidence: 1 to max_retro_gain. 0: the surface is
  /// not a retro-reflector.
  double retro_gain = 0.0;

  bool is_retro_reflector() const noexcept { return retro_gain != 0.0; }
  friend bool operator==(const Material&, const Material&) = default;
};

/// Errors: bad_input for a property outside its range or not finite; the message names the property, its
/// value and the range.
Result<void> validate_material(const Material& material);

}  // namespace rtstdb
