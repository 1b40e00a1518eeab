#pragma once
// Checks the meshes of a glTF file (version 2) before assimp reads it: assimp silently drops triangles whose
// index is damaged, and silently ignores extensions that a file requires.

#include <filesystem>
#include <string_view>

namespace rtstdb {

/// Refuses a required extension that changes geometry, positions that are not three floats, sparse accessors,
/// accessors and views that reach beyond their buffers, indices beyond the positions, and a number of corners
/// that is not a multiple of 3. `binary`: the binary chunk of a GLB file, else empty. `folder`: the folder of
/// the file, for buffers in other files. Throws std::exception with the place and the values; for text that
/// is not JSON, with the byte. Files of other versions are not checked. The caller limits the depth of `json`
/// (json_depth).
void check_gltf_content(std::string_view json, std::string_view binary, const std::filesystem::path& folder);

}  // namespace rtstdb
