#pragma once
// Reads triangle meshes from OBJ files. No vertex is skipped, since that would shift the indices of the later
// ones.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// The vertices (`v`) and polygons (`f`, triangulated) of a file, in its order, with normals (`vn`) and
/// colours (load_mesh). Other statements are ignored; `report`, if not null, names those that load_mesh
/// reports. Throws std::runtime_error with the line and the fault; time and memory are bounded by the size of
/// the file. The mesh may be empty and is not validated.
TriangleMesh read_obj(std::string_view text, double scale, MeshFileReport* report = nullptr);

}  // namespace rtstdb
