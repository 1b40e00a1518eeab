#include "rtstdb/geometry/convex_parts.hpp"

#include <glm/ext/vector_uint3.hpp>

#include <cstdint>
#include <numeric>
#include <utility>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/closed_mesh.hpp"
#include "rtstdb/geometry/hull_triangles.hpp"

namespace rtstdb {
namespace {

/// For each triangle the number of its piece, in the order of their first triangles.
struct Pieces {
  std::vector<std::uint32_t> of_triangles;
  std::uint32_t count = 0;
};

Pieces numbered_pieces(const MeshView& mesh) {
  std::vector<std::uint32_t> parent(mesh.positions_m.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root_of = [&](std::uint32_t corner) {
    while (parent[corner] != corner) {
      parent[corner] = parent[parent[corner]];
      corner = parent[corner];
    }
    return corner;
  };
  for (const glm::uvec3& triangle : mesh.triangles) {
    const std::uint32_t root = root_of(triangle.x);
    parent[root_of(triangle.y)] = root;
    parent[root_of(triangle.z)] = root_of(root);
  }
  Pieces pieces;
  std::vector<std::uint32_t> number(parent.size(), no_index);
  for (const glm::uvec3& triangle : mesh.triangles) {
    std::uint32_t& piece = number[root_of(triangle.x)];
    if (piece == no_index) piece = pieces.count++;
    pieces.of_triangles.push_back(piece);
  }
  return pieces;
}

}  // namespace

ConvexParts convex_parts_of(const MeshView& mesh) {
  // If all pieces are closed, the whole mesh is.
  if (mesh.triangles.size() > max_convex_triangles || !is_closed(mesh)) return {};
  if (auto whole = convex_hull_of_closed(mesh)) return {std::move(*whole)};
  const Pieces pieces = numbered_pieces(mesh);
  if (pieces.count < 2 || pieces.count > max_convex_parts) return {};
  std::vector<TriangleMesh> meshes(pieces.count);
  std::vector<std::vector<std::uint32_t>> numbers(pieces.count);  // of the triangles in the whole mesh
  std::vector<std::uint32_t> local(mesh.positions_m.size(), no_index);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    TriangleMesh& piece = meshes[pieces.of_triangles[t]];
    glm::uvec3& triangle = piece.triangles.emplace_back(mesh.triangles[t]);
    for (int i = 0; i < 3; ++i) {
      std::uint32_t& corner = local[triangle[i]];
      if (corner == no_index) {
        corner = static_cast<std::uint32_t>(piece.positions_m.size());
        piece.positions_m.push_back(mesh.positions_m[triangle[i]]);
      }
      triangle[i] = corner;
    }
    numbers[pieces.of_triangles[t]].push_back(t);
  }
  ConvexParts parts;
  for (std::uint32_t piece = 0; piece < pieces.count; ++piece) {
    auto hull = convex_hull_of(meshes[piece]);
    if (!hull || hull->inside_out != (parts.empty() ? hull->inside_out : parts.front().inside_out)) return {};
    for (std::uint32_t& triangle : hull->face_triangles)
      triangle = numbers[piece][triangle];
    parts.push_back(std::move(*hull));
  }
  return parts;
}

ConvexPartPoints pieces_of(const TriangleMesh& mesh) {
  const Pieces pieces = numbered_pieces(mesh);
  ConvexPartPoints corners_m(pieces.count);
  std::vector<char> is_taken(mesh.positions_m.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t corner = mesh.triangles[t][i];
      if (std::exchange(is_taken[corner], 1) == 0)
        corners_m[pieces.of_triangles[t]].push_back(mesh.positions_m[corner]);
    }
  }
  return corners_m;
}

}  // namespace rtstdb
