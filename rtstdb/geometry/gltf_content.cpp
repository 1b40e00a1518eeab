#include "rtstdb/geometry/gltf_content.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace rtstdb {
namespace gltf_content {
namespace {

using Json = nlohmann::json;

/// Prefixes of extensions that do not change geometry: materials, textures, lights, metadata.
constexpr std::array harmless_extensions{
    "KHR_materials_", "KHR_texture_", "EXT_texture_",   "MSFT_texture_",    "KHR_lights_",  "EXT_lights_",
    "KHR_xmp",        "MSFT_lod",     "KHR_animation_", "ADOBE_materials_", "MSFT_packing_"};

constexpr std::uint64_t component_byte = 5121, component_short = 5123, component_int = 5125,
                        component_float = 5126;

[[noreturn]] void refuse(const std::string& fault) {
  throw std::runtime_error(fault);
}

std::string number(std::uint64_t value) {
  return std::to_string(value);
}

/// Null where `json` is not an object or has no such member.
const Json* member(const Json& json, std::string_view name) {
  if (!json.is_object()) return nullptr;
  const auto found = json.find(name);
  return found != json.end() ? &*found : nullptr;
}

/// The items of `list`; empty where it is null or not an array.
const Json::array_t& items(const Json* list) {
  static const Json::array_t none;
  return list != nullptr && list->is_array() ? list->get_ref<const Json::array_t&>() : none;
}

std::string text_of(const Json* json) {
  return json != nullptr && json->is_string() ? json->get<std::string>() : std::string();
}

std::uint64_t whole_or(const Json& object, std::string_view name, std::uint64_t otherwise,
                       const std::string& place) {
  const Json* value = member(object, name);
  if (value == nullptr) return otherwise;
  if (value->is_number_unsigned()) return value->get<std::uint64_t>();
  constexpr double exact_to = 9007199254740992.0;  // 2^53; some files write 3.0 for 3
  const double real = value->is_number() ? value->get<double>() : -1.0;
  if (real < 0.0 || real > exact_to || real != std::floor(real))
    refuse(place + ": its " + std::string(name) + " is not a whole number");
  return static_cast<std::uint64_t>(real);
}

std::uint64_t whole(const Json& object, std::string_view name, const std::string& place) {
  if (member(object, name) == nullptr) refuse(place + " has no " + std::string(name));
  return whole_or(object, name, 0, place);
}

std::string decode_base64(std::string_view text) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<std::int8_t, 256> values{};
  values.fill(-1);
  for (std::size_t k = 0; k < digits.size(); ++k)
    values[static_cast<unsigned char>(digits[k])] = static_cast<std::int8_t>(k);
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int value = values[static_cast<unsigned char>(c)];
    if (value < 0) continue;  // padding
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xFFu);
  }
  return bytes;
}

/// "a%20b.bin" is "a b.bin".
std::string decode_percent(std::string_view text) {
  std::string decoded;
  for (std::size_t k = 0; k < text.size(); ++k) {
    constexpr std::string_view digits = "0123456789abcdef";
    const auto value = [&](std::size_t at) {
      const char c = text[at];
      return digits.find(c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c);
    };
    if (text[k] == '%' && k + 2 < text.size() && value(k + 1) != digits.npos && value(k + 2) != digits.npos) {
      decoded += static_cast<char>(value(k + 1) * 16 + value(k + 2));
      k += 2;
    } else {
      decoded += text[k];
    }
  }
  return decoded;
}

std::optional<std::string> whole_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return file.is_open() ? std::optional(std::move(bytes)) : std::nullopt;
}

struct Accessor {
  std::string name;  ///< "accessor 3"
  std::uint64_t count = 0;
  std::uint64_t component = 0;
  std::uint64_t stride = 0;
  std::string type;
  std::string_view bytes;  ///< from its first element on; empty: all zeros
};

std::uint64_t component_bytes(std::uint64_t component) {
  switch (component) {
    case component_byte:
      return 1;
    case component_short:
      return 2;
    case component_int:
    case component_float:
      return 4;
    default:
      return 0;
  }
}

class Content {
 public:
  Content(const Json& root, std::string_view binary, const std::filesystem::path& folder)
      : root_(root), binary_(binary), folder_(folder), buffers_(count_of("buffers")) {}

  void check() {
    check_extensions();
    const Json::array_t& meshes = items(member(root_, "meshes"));
    for (std::size_t mesh = 0; mesh < meshes.size(); ++mesh) {
      const Json::array_t& primitives = items(member(meshes[mesh], "primitives"));
      for (std::size_t k = 0; k < primitives.size(); ++k)
        check_primitive(primitives[k], "mesh " + number(mesh) + ", primitive " + number(k));
    }
  }

 private:
  std::size_t count_of(std::string_view list) const { return items(member(root_, list)).size(); }
  const Json& entry(std::string_view list, std::uint64_t index, const std::string& place) const {
    const Json::array_t& entries = items(member(root_, list));
    if (index >= entries.size())
      refuse(place + " names entry " + number(index) + " of " + std::string(list) + ", which has " +
             number(count_of(list)));
    return entries[index];
  }

  void check_extensions() const {
    for (const Json& extension : items(member(root_, "extensionsRequired"))) {
      const std::string name = text_of(&extension);
      const bool harmless = std::ranges::any_of(harmless_extensions,
                                                [&](const char* prefix) { return name.starts_with(prefix); });
      if (!harmless)
        refuse("it requires the extension '" + name +
               "', which is not implemented; export it without that extension");
    }
  }

  void check_primitive(const Json& primitive, const std::string& place) {
    constexpr std::uint64_t triangles = 4, fan = 6;
    const std::uint64_t mode = whole_or(primitive, "mode", triangles, place);
    if (mode < triangles) return;  // points and lines
    if (mode > fan) refuse(place + ": its mode is " + number(mode) + "; 0 to 6 are allowed");
    const Json* attributes = member(primitive, "attributes");
    if (attributes == nullptr || member(*attributes, "POSITION") == nullptr) return;
    const Accessor positions = accessor(whole(*attributes, "POSITION", place), place + ": its POSITION");
    if (positions.component != component_float || positions.type != "VEC3")
      refuse(place + ": its positions (" + positions.name + ") are " + positions.type +
             " of component type " + number(positions.component) +
             "; VEC3 of component type 5126 (float) is allowed");
    std::uint64_t corners = positions.count;
    if (member(primitive, "indices") != nullptr) {
      const Accessor indices = accessor(whole(primitive, "indices", place), place + ": its indices");
      corners = indices.count;
      check_indices(indices, positions, place);
    }
    if (mode == triangles && corners % 3 != 0)
      refuse(place + ": " + number(corners) + " corners are not a multiple of 3");
  }

  static void check_indices(const Accessor& indices, const Accessor& positions, const std::string& place) {
    if (indices.component == component_float || indices.type != "SCALAR")
      refuse(place + ": its indices (" + indices.name + ") are " + indices.type + " of component type " +
             number(indices.component) + "; SCALAR of component type 5121, 5123 or 5125 is allowed");
    const std::uint64_t bytes = component_bytes(indices.component);
    for (std::uint64_t k = 0; k < indices.count; ++k) {
      std::uint32_t index = 0;  // little-endian, as this machine is
      if (!indices.bytes.empty()) std::memcpy(&index, indices.bytes.data() + k * indices.stride, bytes);
      if (index >= positions.count)
        refuse(place + ": index " + number(k) + " (" + indices.name + ") is " + number(index) +
               ", and there are " + number(positions.count) + " positions (" + positions.name + ")");
    }
  }

  Accessor accessor(std::uint64_t index, const std::string& place) {
    const Json& json = entry("accessors", index, place);
    Accessor found;
    found.name = "accessor " + number(index);
    found.count = whole(json, "count", found.name);
    found.component = whole(json, "componentType", found.name);
    const Json* type = member(json, "type");
    found.type = type != nullptr ? text_of(type) : "of no type";
    if (member(json, "sparse") != nullptr) refuse(found.name + " is sparse, which is not supported");
    const std::uint64_t element = component_bytes(found.component) * (found.type == "VEC3" ? 3 : 1);
    found.stride = element;
    if (member(json, "bufferView") == nullptr || element == 0 || found.count == 0) return found;
    const std::uint64_t view = whole(json, "bufferView", found.name);
    const std::string_view bytes = view_bytes(view, found.name + ": its bufferView");
    found.stride = whole_or(entry("bufferViews", view, found.name), "byteStride", element, found.name);
    const std::uint64_t offset = whole_or(json, "byteOffset", 0, found.name);
    const bool fits = found.stride >= element && offset <= bytes.size() && bytes.size() - offset >= element &&
                      found.count - 1 <= (bytes.size() - offset - element) / found.stride;
    if (!fits)
      refuse(found.name + ": " + number(found.count) + " elements of " + number(element) + " bytes, " +
             number(found.stride) + " bytes apart, from byte " + number(offset) +
             " on do not fit into bufferView " + number(view) + " of " + number(bytes.size()) + " bytes");
    found.bytes = bytes.substr(offset);
    return found;
  }

  std::string_view view_bytes(std::uint64_t index, const std::string& place) {
    const Json& view = entry("bufferViews", index, place);
    const std::string name = "bufferView " + number(index);
    const std::uint64_t buffer = whole(view, "buffer", name);
    const std::string_view bytes = buffer_bytes(buffer, name + ": its buffer");
    const std::uint64_t offset = whole_or(view, "byteOffset", 0, name);
    const std::uint64_t length = whole(view, "byteLength", name);
    if (offset > bytes.size() || length > bytes.size() - offset)
      refuse(name + ": " + number(length) + " bytes from byte " + number(offset) +
             " on do not fit into buffer " + number(buffer) + " of " + number(bytes.size()) + " bytes");
    return bytes.substr(offset, length);
  }

  std::string_view buffer_bytes(std::uint64_t index, const std::string& place) {
    const Json& json = entry("buffers", index, place);
    const std::string name = "buffer " + number(index);
    const Json* uri = member(json, "uri");
    if (uri == nullptr) return binary_;
    std::optional<std::string>& bytes = buffers_[index];
    if (bytes) return *bytes;
    constexpr std::string_view data = "data:", base64 = ";base64,";
    const std::string text = text_of(uri);
    if (text.starts_with(data)) {
      const std::size_t at = text.find(base64);
      if (at == std::string::npos) refuse(name + " is data that is not base64, which is not supported");
      bytes = decode_base64(std::string_view(text).substr(at + base64.size()));
    } else {
      bytes = whole_file(folder_ / text);
      if (!bytes) bytes = whole_file(folder_ / decode_percent(text));
      if (!bytes) refuse(name + ", the file '" + text + "', can not be opened");
    }
    return *bytes;
  }

  const Json& root_;
  std::string_view binary_;
  const std::filesystem::path& folder_;
  std::vector<std::optional<std::string>> buffers_;  ///< those that have a URI, once read
};

}  // namespace
}  // namespace gltf_content

void check_gltf_content(std::string_view json, std::string_view binary, const std::filesystem::path& folder) {
  const nlohmann::json root = nlohmann::json::parse(json);
  const nlohmann::json* asset = gltf_content::member(root, "asset");
  if (asset == nullptr || !gltf_content::text_of(gltf_content::member(*asset, "version")).starts_with("2"))
    return;
  gltf_content::Content(root, binary, folder).check();
}

}  // namespace rtstdb
