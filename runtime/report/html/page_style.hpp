#pragma once
// The style sheets, light and dark. No fonts, images or scripts from anywhere.

#include <string_view>

namespace hil::report {

/// Everything inside pictures; begins with the colours, so that it stands alone in an SVG file.
std::string_view picture_style();

/// The page around them.
std::string_view page_style();

}  // namespace hil::report
