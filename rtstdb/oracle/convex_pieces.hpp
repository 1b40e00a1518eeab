#pragma once
// The convex parts of a mesh, as GeometryInfo::convex_parts defines them. Internal to the oracle.

#include <cstdint>
#include <memory>
#include <vector>

#include "rtstdb/oracle/mesh_tree.hpp"

namespace rtstdb::oracle {

struct ConvexPiece {
  std::shared_ptr<const MeshTree> tree;
  std::vector<std::uint32_t> triangles;  ///< in the whole mesh, by index in the piece
};

/// `whole`: the tree of the mesh, which is the only piece if it is convex. Empty: the mesh does not consist
/// of convex parts.
std::vector<ConvexPiece> convex_pieces(const TriangleMesh& mesh,
                                       const std::shared_ptr<const MeshTree>& whole);

}  // namespace rtstdb::oracle
