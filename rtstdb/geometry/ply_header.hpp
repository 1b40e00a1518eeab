#pragma once
// The header of a PLY file. Internal to the PLY reader.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rtstdb::ply {

enum class Format : std::uint8_t { text, little_endian, big_endian };
enum class Type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct Property {
  std::string name;
  Type type = Type::float32;
  bool is_list = false;
  Type count_type = Type::uint8;  ///< of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Format format = Format::text;
  std::vector<Element> elements;
  bool names_texture = false;  ///< in a comment 'TextureFile', as programs do that write texture coordinates
  std::size_t size_bytes = 0;  ///< offset of the data
};

/// Throws std::runtime_error with the line and the fault.
Header read_header(std::string_view bytes);

}  // namespace rtstdb::ply
