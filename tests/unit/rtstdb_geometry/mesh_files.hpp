#pragma once
// Small mesh files for the tests of the loader.

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/geometry.hpp>

namespace rtstdb::mesh_files {

/// The mesh with corners that no triangles share, and with a normal and a colour for each. Colours are those
/// of whole bytes in sRGB. Only meshes of this form are written with normals and colours.
TriangleMesh with_attributes(const TriangleMesh& mesh);

std::string obj(const TriangleMesh& mesh);
std::string ascii_stl(const TriangleMesh& mesh);
std::string binary_stl(const TriangleMesh& mesh);
std::string ascii_ply(const TriangleMesh& mesh);
std::string binary_ply(const TriangleMesh& mesh);
/// `nodes`: the JSON of the nodes array; node 0 is the scene's only root, mesh 0 the only mesh.
std::string gltf(const TriangleMesh& mesh, const std::string& nodes);
std::string glb(const TriangleMesh& mesh, const std::string& nodes);

/// The triangles as corner coordinates, each beginning with its lowest corner (in the order of rotation),
/// sorted: equal for meshes that differ only in the order and sharing of corners.
std::vector<std::array<float, 9>> soup(const TriangleMesh& mesh);

}  // namespace rtstdb::mesh_files
