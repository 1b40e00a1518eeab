#pragma once
// Lays a JSON value out so that a person can read it: objects and lists of objects one entry per line, lists
// of plain numbers or words on one line, wrapped at 120 columns. Text that is not UTF-8 gets U+FFFD for each
// wrong byte.

#include <nlohmann/json.hpp>

#include <string>

namespace hil::report {

/// Ends with a newline. Numbers that are not finite come out as null. Text has to be UTF-8; else nlohmann's
/// type_error.
std::string readable_json(const nlohmann::ordered_json& value);

/// A JSON string literal, quotes included, of any bytes, by valid_utf8.
std::string json_quoted(const std::string& text);

}  // namespace hil::report
