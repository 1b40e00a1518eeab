#pragma once
// Reads JSON text into a tree, for the checks of glTF files that come before assimp reads them.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rtstdb {

struct JsonValue {
  enum class Kind : std::uint8_t { null, boolean, number, string, array, object };
  Kind kind = Kind::null;
  double number = 0.0;  ///< of a number; 1 for true
  std::string text;     ///< of a string, with escapes undone but for \u, which stay as they are
  std::vector<JsonValue> items;
  std::vector<std::pair<std::string, JsonValue>> members;  ///< in the order of the text

  /// Null where this is no object or has no such member; of several with one name, the first.
  const JsonValue* find(std::string_view name) const noexcept;
  /// Null where this is no array or has no such item.
  const JsonValue* item(std::uint64_t index) const noexcept;
  /// A number without a fraction, 0 to 2^53.
  std::optional<std::uint64_t> whole() const noexcept;
};

/// Descends as deep as the text nests: the caller bounds that (json_depth). Throws std::runtime_error with the byte.
JsonValue read_json(std::string_view text);

}  // namespace rtstdb
