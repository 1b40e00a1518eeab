#include "runtime/run/scene_optics.hpp"

#include <array>

namespace hil::run {
namespace {

glm::dvec3 channels(const std::array<double, 3>& rgb) {
  return {rgb[0], rgb[1], rgb[2]};
}

}  // namespace

rtstdb::Material material_of(const config::WorldMaterial& material) {
  return {.reflectance = material.reflectance,
          .retro_gain = material.retro_gain,
          .base_color = channels(material.base_color),
          .metallic = material.metallic,
          .roughness = material.roughness,
          .emission_cdpm2 = channels(material.emission_cdpm2),
          .transmission = material.transmission,
          .refractive_index = material.refractive_index};
}

rtstdb::Light light_of(const config::WorldLight& light) {
  rtstdb::Light made{.color = channels(light.color),
                     .p_m = channels(light.position_m),
                     .illuminance_lx = light.illuminance_lx,
                     .intensity_cd = light.intensity_cd,
                     .inner_angle_rad = light.inner_angle_rad,
                     .outer_angle_rad = light.outer_angle_rad,
                     .angular_diameter_rad = light.angular_diameter_rad,
                     .zenith_cdpm2 = channels(light.zenith_cdpm2),
                     .horizon_cdpm2 = channels(light.horizon_cdpm2),
                     .ground_cdpm2 = channels(light.ground_cdpm2)};
  using enum rtstdb::LightKind;
  for (const rtstdb::LightKind kind : {directional, point, spot, sky})
    if (light.kind == rtstdb::to_string(kind)) made.kind = kind;
  return made;
}

}  // namespace hil::run
