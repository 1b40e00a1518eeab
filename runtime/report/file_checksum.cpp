#include "runtime/report/file_checksum.hpp"

#include <cstdint>
#include <cstdio>

// All functions come from the header: there is no library to link.
#define XXH_INLINE_ALL  // NOLINT(readability-identifier-naming): its name
#include <xxhash.h>

namespace hil::report {
namespace {

constexpr std::string_view line_begin = "  \"checksum\": \"";
constexpr std::string_view line_end = "\"\n}\n";
constexpr std::string_view what_to_do = "; take an unchanged copy, or run the scenario again";

std::string checksum_of(std::string_view text) {
  char words[32];
  std::snprintf(words, sizeof words, "xxh3:%016llx",
                static_cast<unsigned long long>(XXH3_64bits(text.data(), text.size())));
  return words;
}

}  // namespace

std::string with_checksum(std::string json) {
  json.resize(json.find_last_of('}'));
  json.resize(json.find_last_not_of(" \n") + 1);
  json += ",\n";
  const std::string checksum = checksum_of(json);
  return json.append(line_begin).append(checksum).append(line_end);
}

std::string checksum_fault(std::string_view text) {
  const std::size_t line = text.rfind(line_begin);
  if (!text.ends_with(line_end) || line == std::string_view::npos)
    return "it does not end with its checksum: it was cut off, or another program wrote it" +
           std::string(what_to_do);
  const std::size_t begin = line + line_begin.size();
  const std::string_view written = text.substr(begin, text.size() - line_end.size() - begin);
  const std::string found = checksum_of(text.substr(0, line));
  if (written == found) return {};
  return "its checksum is " + std::string(written) + ", and its content has " + found +
         ": it was damaged or changed after the run" + std::string(what_to_do);
}

}  // namespace hil::report
