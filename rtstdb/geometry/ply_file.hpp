#pragma once
// Reads triangle meshes from PLY files, text and binary of either byte order.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// The positions (x, y, z of element `vertex`, times `scale`), normals and colours (load_mesh), and polygons
/// (the list `vertex_indices` or `vertex_index` of element `face`, triangulated) of a file; everything else
/// in it is ignored, and `report`, if not null, names what load_mesh reports of it. Throws std::runtime_error
/// with the place and the fault; time and memory are bounded by the size of the file. The mesh may be empty
/// and is not validated.
TriangleMesh read_ply(std::string_view bytes, double scale, MeshFileReport* report = nullptr);

}  // namespace rtstdb
