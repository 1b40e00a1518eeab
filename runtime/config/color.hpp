#pragma once
// Colours as a scenario writes them.
//
// Threads: pure functions.

#include <array>
#include <optional>
#include <string_view>

namespace hil::config {

/// The linear channels, red, green and blue from 0 to 1, of an sRGB colour "#rrggbb" (IEC 61966-2-1). Empty:
/// the text has another form.
std::optional<std::array<double, 3>> read_srgb_color(std::string_view text);

}  // namespace hil::config
