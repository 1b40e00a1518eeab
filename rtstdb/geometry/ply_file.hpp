#pragma once
// Reads triangle meshes from PLY files, text and binary of either byte order.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// The positions (x, y, z of element `vertex`, times `scale`) and polygons (the list `vertex_indices` or
/// `vertex_index` of element `face`, triangulated) of a whole file; everything else in it is passed over.
/// Throws std::runtime_error with the place and the fault; work and memory are bounded by the file's size.
/// The mesh may be empty and is not validated.
TriangleMesh read_ply(std::string_view bytes, double scale);

}  // namespace rtstdb
