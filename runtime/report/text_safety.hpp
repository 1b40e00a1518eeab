#pragma once
// Makes text of any origin (names, file contents, bus data) safe for a document or a terminal.

#include <string>
#include <string_view>

namespace hil::report {

/// Valid UTF-8: each byte that is not part of a well-formed character becomes U+FFFD.
std::string valid_utf8(std::string_view bytes);

/// Valid UTF-8 of characters that XML 1.0 and HTML allow: each byte that is not UTF-8, and each control
/// character but tab, newline and carriage return, becomes U+FFFD.
std::string clean_text(std::string_view bytes);

/// clean_text, then & < > " ' and line breaks as character references: for element text and quoted
/// attributes of XML and HTML.
std::string escape_markup(std::string_view bytes);

/// clean_text on one line, for a terminal: without control characters; line breaks and tabs become spaces.
std::string one_line(std::string_view bytes);

/// The number of columns of UTF-8 text without wide or combining characters on a terminal.
std::size_t columns_of(std::string_view utf8);

}  // namespace hil::report
