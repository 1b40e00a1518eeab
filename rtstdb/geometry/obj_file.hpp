#pragma once
// Reads triangle meshes from OBJ files. Our own and not assimp's: that leaves out vertices that it can not read, or that are indented, in
// silence, so that every index behind them means another one, and tells of a bad index without the line.

#include <string_view>

#include <rtstdb/geometry.hpp>

namespace rtstdb {

/// The vertices (`v`) and polygons (`f`, triangulated) of a whole file, in its order; all other statements are passed over, and of
/// vertices what follows the three coordinates: a colour. Throws std::runtime_error with the line and the fault; work and memory are bounded by
/// the file's size. The mesh may be empty and is not validated.
TriangleMesh read_obj(std::string_view text, double scale);

}  // namespace rtstdb
