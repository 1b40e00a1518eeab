#pragma once
// A first-order distance field as it is stored, and its evaluation in double precision. The device holds the
// same vertices (shaders/shared/field.h) and evaluates them in single precision (shaders/query/field.glsl).
//
// Threads: constant after its creation: any.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_uint4.hpp>

#include <array>
#include <cstdint>
#include <vector>

#include <rtstdb/field.hpp>

#include "rtstdb/field/grid.hpp"
#include "rtstdb/field/vertex.hpp"
#include "shaders/shared/field.h"

namespace rtstdb::field {

/// Along each axis of a brick, and of the whole brick.
inline constexpr std::uint32_t brick_cells = shared::field_brick_cells;
inline constexpr std::uint32_t brick_vertices = shared::field_brick_vertices;
inline constexpr std::uint32_t vertices_per_brick = brick_vertices * brick_vertices * brick_vertices;

/// The eight vertices around a point. Vertex k is at the corner whose coordinates are the bits 0, 1 and 2
/// of k.
struct Cell {
  double edge_m = 0.0;
  glm::dvec3 at{0.0};  ///< the point, in parts of the cell: 0 to 1
  std::array<double, 8> distances_m{};
  std::array<glm::dvec3, 8> gradients{};
};

/// The distance at the point of a cell; without sign if `is_signed` is false.
///
/// The blended planes d + g (x - v) of the vertices exceed a smooth field by as much as the blended distances
/// d fall short of it, so the mean of both has an error of third order. Where gradients disagree (edges, thin
/// walls, the middle between two walls) the planes get more weight, up to 1: only they are zero where a
/// surface crosses the cell. Without signs a plane counts by its absolute value, so that the surface, which
/// is a crease of the field, remains sharp inside a cell.
double blended_distance_m(const Cell& cell, bool is_signed) noexcept;

struct StoredField {
  Grid grid;
  bool is_signed = false;
  std::vector<std::uint32_t> bricks_of_cells;  ///< by cell: number of the brick, or shared::field_none
  std::vector<Vertex> coarse;                  ///< by Grid::vertex_number
  std::vector<Vertex> bricks;                  ///< shared::field_brick_vertices^3 for each brick
  FieldReport report;

  /// The cell that contains a point: of a brick, if its coarse cell has one. For a point outside the grid:
  /// that of the nearest point of the grid.
  Cell cell_at(const glm::dvec3& point_m) const noexcept;
  /// The distance without sign, as cones use it. For a point outside the grid: that at the nearest point of
  /// the grid.
  double distance_m(const glm::dvec3& point_m) const noexcept;
  /// Negative inside where the field is signed.
  double signed_distance_m(const glm::dvec3& point_m) const noexcept;
  bool is_in_brick(const glm::dvec3& point_m) const noexcept;
};

/// Bytes of the texels that device_texels makes.
std::uint64_t memory_bytes(const Grid& grid, std::uint64_t bricks) noexcept;

/// The texels of a field that begins at texel `first` of the pool.
std::vector<glm::uvec4> device_texels(const StoredField& field, std::uint32_t first);

}  // namespace rtstdb::field
