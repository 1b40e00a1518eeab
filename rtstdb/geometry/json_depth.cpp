#include "rtstdb/geometry/json_depth.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace rtstdb {

std::size_t json_depth(std::string_view text) noexcept {
  std::size_t depth = 0, deepest = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      in_string = c != '"';
      continue;
    }
    in_string = c == '"';
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if ((c == ']' || c == '}') && depth > 0) --depth;
  }
  return deepest;
}

std::string_view glb_json(std::string_view file) noexcept {
  constexpr std::size_t header = 12, chunk_header = 8;
  if (file.size() < header + chunk_header) return {};
  std::uint32_t length = 0;
  std::memcpy(&length, file.data() + header, sizeof length);
  return file.substr(header + chunk_header, length);
}

}  // namespace rtstdb
