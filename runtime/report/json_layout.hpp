#pragma once
// Formats a JSON value for human readers: objects and lists of objects with one entry per line, lists of
// numbers or words on one line, wrapped at 120 columns. U+FFFD replaces each byte that is not UTF-8.

#include <nlohmann/json.hpp>

#include <string>

namespace hil::report {

/// Ends with a newline. Numbers that are not finite become null. Throws nlohmann's type_error for text that
/// is not UTF-8.
std::string readable_json(const nlohmann::ordered_json& value);

/// A JSON string literal, quotes included, of any bytes, by valid_utf8.
std::string json_quoted(const std::string& text);

}  // namespace hil::report
