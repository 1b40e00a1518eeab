#include <cstdio>
#include <string>

#include <rtstdb/limits.hpp>
#include <rtstdb/material.hpp>

namespace rtstdb {
namespace {

Error outside(const char* property, double value, const char* allowed) {
  char text[160];
  std::snprintf(text, sizeof text, "%s is %.9g; allowed is %s", property, value, allowed);
  return {ErrorCode::bad_input, text};
}

}  // namespace

Result<void> validate_material(const Material& material) {
  // A NaN fails every condition.
  if (!(material.reflectance >= 0.0 && material.reflectance <= 1.0))
    return outside("reflectance", material.reflectance, "0 to 1");
  const bool possible_gain =
      material.retro_gain == 0.0 || (material.retro_gain >= 1.0 && material.retro_gain <= max_retro_gain);
  if (!possible_gain) return outside("retro_gain", material.retro_gain, "0, or 1 to 1e6");
  return {};
}

}  // namespace rtstdb
