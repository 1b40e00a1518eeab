#pragma once
// The coarse grid of a distance field: cubic cells over the box of the geometry, with a margin on all sides.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <cstdint>

#include <rtstdb/geometry.hpp>

namespace rtstdb::field {

struct Grid {
  glm::vec3 origin_m{0.0f};  ///< the lowest corner
  float cell_m = 0.0f;       ///< edge of a cell
  glm::uvec3 cells{0};       ///< along each axis

  std::uint64_t cell_count() const noexcept { return std::uint64_t{cells.x} * cells.y * cells.z; }
  std::uint64_t vertex_count() const noexcept {
    return std::uint64_t{cells.x + 1} * (cells.y + 1) * (cells.z + 1);
  }
  std::uint32_t cell_number(const glm::uvec3& cell) const noexcept {
    return (cell.z * cells.y + cell.y) * cells.x + cell.x;
  }
  glm::uvec3 cell(std::uint32_t number) const noexcept {
    return {number % cells.x, number / cells.x % cells.y, number / cells.x / cells.y};
  }
  std::uint32_t vertex_number(const glm::uvec3& vertex) const noexcept {
    return (vertex.z * (cells.y + 1) + vertex.y) * (cells.x + 1) + vertex.x;
  }
  glm::uvec3 vertex(std::uint32_t number) const noexcept {
    return {number % (cells.x + 1), number / (cells.x + 1) % (cells.y + 1),
            number / (cells.x + 1) / (cells.y + 1)};
  }
  /// The point at these coordinates, which count in cells from the origin and need not be whole numbers.
  glm::vec3 point(const glm::dvec3& in_cells) const noexcept {
    return glm::vec3(glm::dvec3(origin_m) + static_cast<double>(cell_m) * in_cells);
  }
};

/// The grid of a box, with a margin of at least half a cell on every side. Cells are larger than `cell_m` if
/// the box is so far from the origin that single precision would not separate neighbouring vertices. Cell and
/// vertex numbers of 32 bits suffice for grids that fit into max_field_bytes.
Grid grid_around(const Bounds& box, double cell_m) noexcept;

}  // namespace rtstdb::field
