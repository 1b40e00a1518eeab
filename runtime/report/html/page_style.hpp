#pragma once
// The style sheets, light and dark, without fonts, images or scripts.

#include <string_view>

namespace hil::report {

/// The style of pictures, with the colours, so that it is complete in an SVG file.
std::string_view picture_style();

/// The style of the page.
std::string_view page_style();

}  // namespace hil::report
