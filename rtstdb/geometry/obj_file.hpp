#pragma once
// Reads triangle meshes from OBJ files. No vertex is skipped, since that would shift the indices of the later
// ones.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// The vertices (`v`) and polygons (`f`, triangulated) of a file, in its order. Other statements are ignored,
/// and so is what follows the three coordinates of a vertex, such as a colour. Throws std::runtime_error with
/// the line and the fault; time and memory are bounded by the size of the file. The mesh may be empty and is
/// not validated.
TriangleMesh read_obj(std::string_view text, double scale);

}  // namespace rtstdb
