#include "rtstdb/oracle/convex_pieces.hpp"

#include <map>
#include <numeric>
#include <set>

#include <rtstdb/limits.hpp>

namespace rtstdb::oracle {
namespace {

/// For each triangle the lowest index of a triangle that it is connected with by shared corners.
std::vector<std::uint32_t> connected_to(const TriangleMesh& mesh) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> at_corner;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (int i = 0; i < 3; ++i)
      at_corner[mesh.triangles[t][i]].push_back(t);
  std::vector<std::uint32_t> lowest(mesh.triangles.size(), 0xFFFFFFFFu);
  for (std::uint32_t start = 0; start < mesh.triangles.size(); ++start) {
    if (lowest[start] != 0xFFFFFFFFu) continue;
    std::vector<std::uint32_t> open{start};
    lowest[start] = start;
    while (!open.empty()) {
      const glm::uvec3 corners = mesh.triangles[open.back()];
      open.pop_back();
      for (int i = 0; i < 3; ++i) {
        for (const std::uint32_t beside : at_corner[corners[i]]) {
          if (lowest[beside] != 0xFFFFFFFFu) continue;
          lowest[beside] = start;
          open.push_back(beside);
        }
      }
    }
  }
  return lowest;
}

}  // namespace

std::vector<ConvexPiece> convex_pieces(const TriangleMesh& mesh,
                                       const std::shared_ptr<const MeshTree>& whole) {
  if (mesh.triangles.size() > max_convex_triangles) return {};
  if (whole->convex()) {
    std::vector<std::uint32_t> all(mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    return {{whole, std::move(all)}};
  }
  const std::vector<std::uint32_t> lowest = connected_to(mesh);
  const std::set<std::uint32_t> starts(lowest.begin(), lowest.end());
  if (starts.size() < 2 || starts.size() > max_convex_parts) return {};
  std::vector<ConvexPiece> pieces;
  for (const std::uint32_t start : starts) {
    TriangleMesh part{.positions_m = mesh.positions_m, .triangles = {}};
    ConvexPiece piece;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      if (lowest[t] != start) continue;
      part.triangles.push_back(mesh.triangles[t]);
      piece.triangles.push_back(t);
    }
    piece.tree = std::make_shared<const MeshTree>(part);
    if (!piece.tree->convex()) return {};
    if (!pieces.empty() && pieces.front().tree->inside_out() != piece.tree->inside_out()) return {};
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

}  // namespace rtstdb::oracle
