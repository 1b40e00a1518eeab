#include "runtime/config/color.hpp"

#include <charconv>
#include <cmath>

namespace hil::config {
namespace {

double linear(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

}  // namespace

std::optional<std::array<double, 3>> read_srgb_color(std::string_view text) {
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  std::array<double, 3> channels{};
  for (std::size_t k = 0; k < 3; ++k) {
    const char* const digits = text.data() + 1 + 2 * k;
    unsigned value = 0;
    // from_chars reads no sign of an unsigned number.
    const auto [end, error] = std::from_chars(digits, digits + 2, value, 16);
    if (error != std::errc() || end != digits + 2) return std::nullopt;
    channels[k] = linear(value / 255.0);
  }
  return channels;
}

}  // namespace hil::config
