#include "rtstdb/geometry/gltf_accessors.hpp"

#include <array>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

namespace rtstdb::gltf {
namespace {

std::string decode_base64(std::string_view text) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<int, 256> values{};
  values.fill(-1);
  for (std::size_t k = 0; k < digits.size(); ++k)
    values[static_cast<unsigned char>(digits[k])] = static_cast<int>(k);
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

/// None: it cannot be opened, or it is not a regular file, which might have no end.
std::optional<std::string> bytes_of_file(const std::filesystem::path& path) {
  std::error_code failed;
  if (!std::filesystem::is_regular_file(path, failed)) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return file.is_open() ? std::optional(std::move(bytes)) : std::nullopt;
}

}  // namespace

std::uint64_t component_bytes(std::uint64_t component) {
  switch (static_cast<Component>(component)) {
    case Component::byte:
      return 1;
    case Component::int16:
      return 2;
    case Component::int32:
    case Component::float32:
      return 4;
  }
  return 0;
}

const Json& entry(const Json& root, std::string_view list, std::uint64_t index, const std::string& place) {
  const Json::array_t& entries = items(member(root, list));
  if (index >= entries.size())
    refuse(place + " names entry " + number(index) + " of " + std::string(list) + ", which has " +
           number(entries.size()));
  return entries[index];
}

Accessors::Accessors(const Json& root, std::string_view binary, const std::filesystem::path& folder)
    : root_(root), binary_(binary), folder_(folder), buffers_(items(member(root, "buffers")).size()) {}

Accessor Accessors::at(std::uint64_t index, const std::string& place) {
  const Json& json = entry(root_, "accessors", index, place);
  Accessor found;
  found.name = "accessor " + number(index);
  found.count = whole(json, "count", found.name);
  found.component = whole(json, "componentType", found.name);
  const Json* type = member(json, "type");
  found.type = type != nullptr ? text_of(type) : "of no type";
  if (member(json, "sparse") != nullptr) refuse(found.name + " is sparse, which is not supported");
  const Json* normalized = member(json, "normalized");
  found.normalized = normalized != nullptr && normalized->is_boolean() && normalized->get<bool>();
  const std::uint64_t components = found.type == "VEC4" ? 4 : found.type == "VEC3" ? 3 : 1;
  const std::uint64_t element = component_bytes(found.component) * components;
  if (element == 0 || found.count == 0) return found;
  if (member(json, "bufferView") == nullptr)
    refuse(found.name + " has no bufferView; export the mesh with its data and without compression");
  const std::uint64_t view = whole(json, "bufferView", found.name);
  const std::string_view bytes = view_bytes(view, found.name + ": its bufferView");
  found.stride = whole_or(entry(root_, "bufferViews", view, found.name), "byteStride", element, found.name);
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

std::string_view Accessors::view_bytes(std::uint64_t index, const std::string& place) {
  const Json& view = entry(root_, "bufferViews", index, place);
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

std::string_view Accessors::buffer_bytes(std::uint64_t index, const std::string& place) {
  const Json& json = entry(root_, "buffers", index, place);
  const std::string name = "buffer " + number(index);
  const Json* uri = member(json, "uri");
  const std::string_view bytes = uri == nullptr ? binary_ : external_bytes(index, text_of(uri), name);
  const std::uint64_t declared = whole_or(json, "byteLength", 0, name);
  if (declared > bytes.size())
    refuse(name + " has " + number(bytes.size()) + " bytes, and its byteLength is " + number(declared));
  return bytes;
}

std::string_view Accessors::external_bytes(std::uint64_t index, const std::string& uri,
                                           const std::string& name) {
  std::optional<std::string>& bytes = buffers_[index];
  if (bytes) return *bytes;
  constexpr std::string_view data = "data:", base64 = ";base64,";
  if (uri.starts_with(data)) {
    const std::size_t at = uri.find(base64);
    if (at == std::string::npos) refuse(name + " is data that is not base64, which is not supported");
    bytes = decode_base64(std::string_view(uri).substr(at + base64.size()));
  } else {
    bytes = bytes_of_file(folder_ / uri);
    if (!bytes) bytes = bytes_of_file(folder_ / decode_percent(uri));
    if (!bytes) refuse(name + ", the file '" + uri + "', can not be opened");
  }
  return *bytes;
}

}  // namespace rtstdb::gltf
