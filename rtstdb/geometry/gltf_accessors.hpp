#pragma once
// The accessors of a glTF file: their bytes, checked against their buffers. Internal to the glTF reader.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rtstdb/geometry/gltf_json.hpp"

namespace rtstdb::gltf {

enum class Component : std::uint16_t { byte = 5121, int16 = 5123, int32 = 5125, float32 = 5126 };

/// All elements of the accessor are within `bytes`.
struct Accessor {
  std::string name;  ///< "accessor 3"
  std::uint64_t count = 0;
  std::uint64_t component = 0;
  std::uint64_t stride = 0;
  bool normalized = false;
  std::string type;
  std::string_view bytes;  ///< from its first element on; valid as long as the Accessors

  bool has(Component wanted) const { return component == static_cast<std::uint64_t>(wanted); }
};

/// Size of a component type; zero for a type that nothing may have that is read.
std::uint64_t component_bytes(std::uint64_t component);

/// Reads accessors, and the buffers that they refer to. All functions throw std::exception with the place and
/// the values.
class Accessors {
 public:
  /// `binary`: the binary chunk of a GLB file, otherwise empty. `folder`: the folder of the file, for buffers
  /// in other files. All three must outlive the object.
  Accessors(const Json& root, std::string_view binary, const std::filesystem::path& folder);

  /// `place`: what refers to the accessor, for error texts.
  Accessor at(std::uint64_t index, const std::string& place);

 private:
  std::string_view view_bytes(std::uint64_t index, const std::string& place);
  std::string_view buffer_bytes(std::uint64_t index, const std::string& place);
  /// The bytes of a buffer with this URI; read once.
  std::string_view external_bytes(std::uint64_t index, const std::string& uri, const std::string& name);

  const Json& root_;
  std::string_view binary_;
  const std::filesystem::path& folder_;
  std::vector<std::optional<std::string>> buffers_;  ///< buffers with a URI, when read
};

/// An entry of one of the file's lists, such as "meshes". `place`: what refers to the entry, for error texts.
const Json& entry(const Json& root, std::string_view list, std::uint64_t index, const std::string& place);

}  // namespace rtstdb::gltf
