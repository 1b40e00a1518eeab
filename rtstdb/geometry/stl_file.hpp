#pragma once
// Reads triangle meshes from STL files, binary and text.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// All facets of a whole file, in its order, three positions each; normals, names and attribute bytes are
/// ignored. A file that begins with "solid" and has no zero byte among its first 84 is text. Throws
/// std::runtime_error with the place and the fault. Work and memory grow linearly with the file's size. The
/// mesh may be empty and is not validated.
TriangleMesh read_stl(std::string_view file, double scale);

}  // namespace rtstdb
