#pragma once
// Strings of a DBC file as UTF-8.

#include <string>
#include <string_view>

namespace hil::io::can {

/// The content of a quoted string: `\"` becomes a quote and `\\` a backslash. A string that is not UTF-8 is
/// read as cp1252.
std::string dbc_text(std::string_view written);

}  // namespace hil::io::can
