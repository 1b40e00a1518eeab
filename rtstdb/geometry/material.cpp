#include <rtstdb/limits.hpp>
#include <rtstdb/material.hpp>

#include "rtstdb/geometry/property_check.hpp"

namespace rtstdb {

Result<void> validate_material(const Material& material) {
  PropertyCheck check;
  check.range("reflectance", material.reflectance, 0.0, 1.0, "0 to 1");
  if (material.retro_gain != 0.0)
    check.range("retro_gain", material.retro_gain, 1.0, max_retro_gain, "0, or 1 to 1e6");
  check.channels("base_color", material.base_color, 0.0, 1.0, "0 to 1");
  check.range("metallic", material.metallic, 0.0, 1.0, "0 to 1");
  check.range("roughness", material.roughness, 0.0, 1.0, "0 to 1");
  check.channels("emission_cdpm2", material.emission_cdpm2, 0.0, max_luminance_cdpm2, "0 to 1e10");
  check.range("transmission", material.transmission, 0.0, 1.0, "0 to 1");
  check.range("refractive_index", material.refractive_index, 1.0, max_refractive_index, "1 to 4");
  return check.result();
}

}  // namespace rtstdb
