#pragma once
// Reads triangle meshes from OBJ files. A vertex is never left out: every index behind it would name another one.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// The vertices (`v`) and polygons (`f`, triangulated) of a whole file, in its order; all other statements are passed over, and of
/// vertices what follows the three coordinates: a colour. Throws std::runtime_error with the line and the fault; work and memory are bounded by
/// the file's size. The mesh may be empty and is not validated.
TriangleMesh read_obj(std::string_view text, double scale);

}  // namespace rtstdb
