#pragma once
// How deep a JSON text nests. assimp's JSON reader descends by recursion without a limit: a file of brackets would
// end the process, so it is measured first.

#include <cstddef>
#include <string_view>

namespace rtstdb {

/// Deepest nesting of arrays and objects; brackets in strings do not count. The text need not be valid.
std::size_t json_depth(std::string_view text) noexcept;

/// The JSON chunk of a GLB file; what is there of it when the file is cut off, empty when it has none.
std::string_view glb_json(std::string_view file) noexcept;

}  // namespace rtstdb
