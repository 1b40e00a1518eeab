#include "rtstdb/geometry/gltf_check.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace rtstdb {
namespace {

constexpr std::size_t header_bytes = 12;
constexpr std::size_t chunk_header_bytes = 8;

/// Little-endian, as this machine is.
std::uint32_t word_at(std::string_view file, std::size_t offset) noexcept {
  std::uint32_t word = 0;
  std::memcpy(&word, file.data() + offset, sizeof word);
  return word;
}

}  // namespace

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
  if (file.size() < header_bytes + chunk_header_bytes) return {};
  return file.substr(header_bytes + chunk_header_bytes, word_at(file, header_bytes));
}

std::string_view glb_binary(std::string_view file) noexcept {
  constexpr std::uint32_t binary_type = 0x004E4942;  // "BIN"
  for (std::size_t chunk = header_bytes; chunk + chunk_header_bytes <= file.size();) {
    const std::size_t bytes = word_at(file, chunk);
    if (word_at(file, chunk + 4) == binary_type) return file.substr(chunk + chunk_header_bytes, bytes);
    chunk += chunk_header_bytes + bytes;
  }
  return {};
}

std::optional<std::string> glb_fault(std::string_view file) {
  constexpr std::size_t least = header_bytes + chunk_header_bytes;
  constexpr std::uint32_t json_type = 0x4E4F534A;  // "JSON"
  if (file.size() < least)
    return "has " + std::to_string(file.size()) + " bytes, and a GLB file has at least " +
           std::to_string(least);
  if (!file.starts_with("glTF")) return "does not begin with 'glTF'";
  if (word_at(file, 4) != 2)
    return "is GLB version " + std::to_string(word_at(file, 4)) + "; version 2 is read";
  const std::size_t length = word_at(file, 8);
  if (length > file.size())
    return "says that it has " + std::to_string(length) + " bytes, and has " + std::to_string(file.size());
  for (std::size_t chunk = header_bytes; chunk < length;) {
    const std::size_t left = length - chunk;
    if (left < chunk_header_bytes) return "ends within the head of a chunk at byte " + std::to_string(chunk);
    const std::size_t bytes = word_at(file, chunk);
    if (bytes > left - chunk_header_bytes)
      return "has a chunk at byte " + std::to_string(chunk) + " that says " + std::to_string(bytes) +
             " bytes, and " + std::to_string(left - chunk_header_bytes) + " are left";
    chunk += chunk_header_bytes + bytes;
  }
  if (word_at(file, header_bytes + 4) != json_type) return "has a first chunk that is not of the type JSON";
  return std::nullopt;
}

}  // namespace rtstdb
