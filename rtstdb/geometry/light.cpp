#include <rtstdb/light.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/property_check.hpp"

namespace rtstdb {
namespace {

constexpr const char* luminance_range = "0 to 1e10";

/// `is_used`: whether the kind uses the property.
template <class Property>
void check_use(PropertyCheck& check, const Light& light, const char* name, Property Light::*property,
               bool is_used) {
  if (!is_used && !(light.*property == Light{}.*property))
    check.refuse(std::string(name) + " is not used by a light of kind " + to_string(light.kind) +
                 "; leave it at its default");
}

void check_unused(PropertyCheck& check, const Light& light) {
  const bool is_directional = light.kind == LightKind::directional, is_spot = light.kind == LightKind::spot,
             is_sky = light.kind == LightKind::sky;
  check_use(check, light, "color", &Light::color, !is_sky);
  check_use(check, light, "illuminance_lx", &Light::illuminance_lx, is_directional);
  check_use(check, light, "p_m", &Light::p_m, is_spot || light.kind == LightKind::point);
  check_use(check, light, "intensity_cd", &Light::intensity_cd, is_spot || light.kind == LightKind::point);
  check_use(check, light, "inner_angle_rad", &Light::inner_angle_rad, is_spot);
  check_use(check, light, "outer_angle_rad", &Light::outer_angle_rad, is_spot);
  check_use(check, light, "angular_diameter_rad", &Light::angular_diameter_rad, is_directional);
  check_use(check, light, "zenith_cdpm2", &Light::zenith_cdpm2, is_sky);
  check_use(check, light, "horizon_cdpm2", &Light::horizon_cdpm2, is_sky);
  check_use(check, light, "ground_cdpm2", &Light::ground_cdpm2, is_sky);
}

void check_spot(PropertyCheck& check, const Light& light) {
  check.range("outer_angle_rad", light.outer_angle_rad, min_spot_angle_rad, max_spot_angle_rad,
              "0.01 to 3.1416");
  check.range("inner_angle_rad", light.inner_angle_rad, 0.0, light.outer_angle_rad,
              "0 to the outer_angle_rad");
}

}  // namespace

const char* to_string(LightKind kind) noexcept {
  switch (kind) {
    case LightKind::directional:
      return "directional";
    case LightKind::point:
      return "point";
    case LightKind::spot:
      return "spot";
    case LightKind::sky:
      return "sky";
  }
  return "unknown";
}

Result<void> validate_light(const Light& light) {
  PropertyCheck check;
  switch (light.kind) {
    case LightKind::directional:
      check.positive("illuminance_lx", light.illuminance_lx, max_illuminance_lx, "above 0, at most 1e7");
      check.range("angular_diameter_rad", light.angular_diameter_rad, 0.0, max_angular_diameter_rad,
                  "0 to 0.2");
      break;
    case LightKind::spot:
      check_spot(check, light);
      [[fallthrough]];
    case LightKind::point:
      check.positive("intensity_cd", light.intensity_cd, max_intensity_cd, "above 0, at most 1e10");
      check.range("p_m.x", light.p_m.x, -max_coordinate_m, max_coordinate_m, "-1e5 to 1e5");
      check.range("p_m.y", light.p_m.y, -max_coordinate_m, max_coordinate_m, "-1e5 to 1e5");
      check.range("p_m.z", light.p_m.z, -max_coordinate_m, max_coordinate_m, "-1e5 to 1e5");
      break;
    case LightKind::sky:
      check.channels("zenith_cdpm2", light.zenith_cdpm2, 0.0, max_luminance_cdpm2, luminance_range);
      check.channels("horizon_cdpm2", light.horizon_cdpm2, 0.0, max_luminance_cdpm2, luminance_range);
      check.channels("ground_cdpm2", light.ground_cdpm2, 0.0, max_luminance_cdpm2, luminance_range);
      break;
    default:
      check.refuse("kind is " + std::to_string(static_cast<unsigned>(light.kind)) +
                   "; allowed are the enumerators of LightKind");
      return check.result();
  }
  check.channels("color", light.color, 0.0, max_light_color, "0 to 1000");
  if (light.color == glm::dvec3(0.0)) check.refuse("color is 0 in all channels; one has to be above 0");
  check_unused(check, light);
  return check.result();
}

}  // namespace rtstdb
