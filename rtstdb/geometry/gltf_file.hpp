#pragma once
// Reads triangle meshes from glTF 2 files.

#include <filesystem>
#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// The triangles of the default scene (the first scene if the file names none), node by node in the file's
/// order, with the transforms of the nodes, normals and colours (load_mesh). `report`: null, or what
/// load_mesh reports of the file. `binary`: the binary chunk of a GLB file, otherwise empty. `folder`: the
/// folder of the file, for buffers in other files. Without recursion: nodes may nest as deep as the file has
/// nodes. The caller limits the depth of `json` (json_depth). The mesh may be empty and is not validated.
///
/// Throws std::exception with the place and the values (for invalid JSON, with the byte) for: another
/// version, a required extension that changes geometry, a primitive without positions, positions that are not
/// three floats, the faults of CornerAccessors, sparse accessors, accessors and views beyond their buffers,
/// indices beyond the positions, a number of corners that is not a multiple of 3, a node with two parents,
/// and the faults of node_to_parent. Error: capacity, for more than max_triangles_total triangles.
Result<TriangleMesh> read_gltf(std::string_view json, std::string_view binary,
                               const std::filesystem::path& folder, double scale,
                               MeshFileReport* report = nullptr);

}  // namespace rtstdb
