#pragma once
// Distances from the surface of a mesh, on the CPU, where shapes that stand for the mesh are checked
// (solid_hull.hpp, given_parts.hpp).
//
// Threads: pure functions; const functions of a MeshSurface from any thread. Construction allocates.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "rtstdb/geometry/mesh_view.hpp"

namespace rtstdb {

/// The corners of a triangle.
using Corners = std::array<glm::dvec3, 3>;
Corners corners_of(const MeshView& mesh, std::uint32_t triangle);

/// Of the positions that triangles use, exact.
Bounds box_of(const MeshView& mesh);
double diagonal_m(const Bounds& box);

/// From a point to the nearest triangle. Its time grows with their number.
double distance_to_mesh_m(const MeshView& mesh, const glm::dvec3& p_m);
/// From a point to the nearest point of a triangle, which may have no area.
double distance_to_triangle_m(const Corners& corners, const glm::dvec3& p_m);

/// Appends points of a triangle, its corners among them: every point of the triangle is within `spacing_m` of
/// one of them.
void append_samples(const Corners& corners, double spacing_m, std::vector<glm::dvec3>& points_m);

class MeshSurface {
 public:
  /// `reach_m`: of is_within_reach(), positive. Memory: the mesh's positions, and one point for each square
  /// of half the reach on the surface. The mesh outlives it.
  MeshSurface(const MeshView& mesh, double reach_m);

  /// Points of the surface, all corners among them: every point of it is within half the reach of one of
  /// them.
  const std::vector<glm::dvec3>& samples_m() const noexcept { return samples_m_; }
  /// Whether the surface has a point that is not farther than the reach.
  bool is_within_reach(const glm::dvec3& p_m) const;
  /// The share of all directions that the surface covers, with the sign of the side that is seen: 1 or -1
  /// inside a closed mesh, 0 outside. Its time grows with the number of triangles.
  /// Source: Jacobson, Kavan, Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding
  /// numbers", 2013.
  double winding_number(const glm::dvec3& p_m) const;

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct CellHash {
    std::size_t operator()(const Cell& cell) const noexcept;
  };
  Cell cell_of(const glm::dvec3& p_m) const noexcept;

  const MeshView mesh_;
  const double reach_m_;
  std::vector<glm::dvec3> samples_m_;
  std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> samples_of_;  ///< by cell of a grid
};

}  // namespace rtstdb
