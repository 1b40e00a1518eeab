#pragma once
// The transfer function of sRGB (IEC 61966-2-1). Pure functions; any thread.

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace rtstdb {

/// `encoded`: 0 to 1.
inline double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

/// `linear`: 0 to 1.
inline double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

/// As 8 bits, of a value that is cut to 0 to 1.
inline std::uint8_t srgb8_from_linear(double linear) {
  return static_cast<std::uint8_t>(std::lround(255.0 * srgb_from_linear(std::clamp(linear, 0.0, 1.0))));
}

}  // namespace rtstdb
