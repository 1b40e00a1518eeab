#pragma once
// Checks of a glTF file before its JSON is parsed: how deep the JSON nests, and whether the chunks of a GLB
// file lie in it.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace rtstdb {

/// Deepest nesting of arrays and objects; brackets in strings do not count. The text need not be valid.
std::size_t json_depth(std::string_view text) noexcept;

/// The JSON chunk of a GLB file, shortened if the file is truncated; empty if it has none.
std::string_view glb_json(std::string_view file) noexcept;

/// The binary chunk of a GLB file for which glb_fault is empty; empty when the file has none.
std::string_view glb_binary(std::string_view file) noexcept;

/// The fault of the header of a GLB file or of the lengths of its chunks; none: they are valid.
std::optional<std::string> glb_fault(std::string_view file);

}  // namespace rtstdb
