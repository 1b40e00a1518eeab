#pragma once
// A value in a JSON file and its place, for readers: what is not as expected is refused with the place. For
// the files of this folder.

#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>

#include "runtime/report/report_json.hpp"

namespace hil::report {

struct JsonCursor {
  const std::string& file;
  const nlohmann::ordered_json& json;
  std::string path;

  [[noreturn]] void refuse(const std::string& wanted) const {
    throw ReportError(file + ": " + (path.empty() ? "the file" : path) + " is " + json.type_name() +
                      ", not " + wanted);
  }
  JsonCursor item(std::size_t index) const {
    return {file, json[index], path + '[' + std::to_string(index) + ']'};
  }
  JsonCursor member(const char* key) const {
    if (!json.is_object()) refuse("an object");
    const auto found = json.find(key);
    const std::string where = path.empty() ? key : path + '.' + key;
    if (found == json.end()) throw ReportError(file + ": " + where + " is missing");
    return {file, *found, where};
  }
};

}  // namespace hil::report
