#pragma once
// Checks what a glTF file (version 2) says of its meshes before assimp reads it: assimp drops triangles whose index is damaged, and
// ignores extensions that a file requires, without a word.

#include <filesystem>
#include <string_view>

namespace rtstdb {

/// Refuses: an extension that the file requires and that changes geometry; of a mesh, positions that are not three floats, accessors
/// and views that lead out of their buffers, indices beyond the positions or of a count that makes no triangles. `binary`: the
/// binary chunk of a GLB file. `folder`: where buffers in files of their own lie. Throws std::exception with the place and
/// the values; of text that is no JSON, with the byte. Files of other versions are not looked at. The caller has bounded how
/// deep `json` nests (json_depth).
void check_gltf_content(std::string_view json, std::string_view binary, const std::filesystem::path& folder);

}  // namespace rtstdb
