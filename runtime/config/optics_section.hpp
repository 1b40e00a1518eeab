#pragma once
// The materials and the lights of a scenario (world.materials, world.lights), which entities name. Colours
// are linear and have the primaries of sRGB.
//
// Threads: immutable once loaded.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/expression.hpp"

namespace hil::config {

/// A surface (rtstdb/material.hpp).
struct WorldMaterial {
  Word name;
  double reflectance = 1.0;  ///< 0 to 1
  double retro_gain = 0.0;   ///< 0: no retro-reflector; else at least 1
  std::array<double, 3> base_color{};
  double metallic = 0.0;
  double roughness = 0.0;
  std::array<double, 3> emission_cdpm2{};
  double transmission = 0.0;
  double refractive_index = 0.0;
};

/// A light (rtstdb/light.hpp). What its kind does not use has its default.
struct WorldLight {
  Word name;
  std::string kind;  ///< rtstdb::to_string(LightKind)
  std::array<double, 3> color{1.0, 1.0, 1.0};
  std::array<double, 3> position_m{};  ///< in the entity's frame
  double illuminance_lx = 0.0;
  double intensity_cd = 0.0;
  double inner_angle_rad = 0.0, outer_angle_rad = 0.0;
  double angular_diameter_rad = 0.0;
  std::array<double, 3> zenith_cdpm2{}, horizon_cdpm2{}, ground_cdpm2{};
};

struct World;

/// Of one material, and of one light.
Schema material_schema();
Schema light_schema();

/// Add the entries without mistakes. Return the names of all entries, also of those with mistakes; empty when
/// a name is missing or given twice, since a name that seems unknown may be meant for that entry.
using KnownNames = std::optional<std::vector<std::string>>;
KnownNames read_materials(const Value* list, World& world, Diagnostics& diagnostics);
KnownNames read_lights(const Value* list, World& world, Diagnostics& diagnostics);

}  // namespace hil::config
