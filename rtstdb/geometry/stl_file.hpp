#pragma once
// Reads triangle meshes from STL files, binary and text.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// All facets of a file, in its order, with three positions each; normals, names and attribute bytes are
/// ignored. A file is text if it begins with "solid" and has no zero byte among its first 84. Throws
/// std::runtime_error with the place and the fault. Time and memory are linear in the size of the file. The
/// mesh may be empty and is not validated.
TriangleMesh read_stl(std::string_view file, double scale);

}  // namespace rtstdb
