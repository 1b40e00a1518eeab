#pragma once
// Reads triangle meshes from STL files, binary and text. The reader is not assimp's: that one takes a count that contradicts the
// file's size, and a facet that lacks a corner, without a word.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// All facets of a whole file, in its order, three positions each; normals, names and attribute bytes are passed over. A file that
/// begins with "solid" and holds no zero byte in its first 84 is text. Throws std::runtime_error with the place and the fault; work
/// and memory are bounded by the file's size. The mesh may be empty and is not validated.
TriangleMesh read_stl(std::string_view file, double scale);

}  // namespace rtstdb
