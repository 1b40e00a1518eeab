#pragma once
// A material: the optical properties of a surface. Registered once (Database::add_material), then named by
// the rows of entities; it never changes. Sensors that are simulated with rays and cones read it.
//
// Threads: pure functions and plain data; any thread.

#include <rtstdb/result.hpp>

namespace rtstdb {

/// Each member is a property that a default describes completely. Callers name the members that they set
/// (Material{.reflectance = 0.2}), and a log holds a material as a list of properties
/// (rtstdb/log/format.hpp). So a property can be added without a change of callers, of existing logs or of
/// their format.
struct Material {
  /// Share of the incident light that a matt (Lambertian) surface scatters back, at normal incidence: 0 to 1.
  double reflectance = 1.0;
  /// A retro-reflector returns this many times as much light toward its source as a matt surface of the same
  /// reflectance at normal incidence, whatever the angle of incidence: 1 to max_retro_gain. 0: the surface is
  /// no retro-reflector.
  double retro_gain = 0.0;

  bool is_retro_reflector() const noexcept { return retro_gain != 0.0; }
  friend bool operator==(const Material&, const Material&) = default;
};

/// Errors: bad_input for a property outside its range or not finite; the message names the property, its
/// value and the range.
Result<void> validate(const Material& material);

}  // namespace rtstdb
