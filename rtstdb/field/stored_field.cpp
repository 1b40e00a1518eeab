#include "rtstdb/field/stored_field.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>

#include "shaders/shared/field.h"

namespace rtstdb::field {
namespace {

static_assert(brick_vertices == brick_cells + 1 && brick_cells == field_cells_per_brick);
static_assert(2 * shared::field_brick_texels == vertices_per_brick, "rows of bricks have no padding");

glm::uvec3 corner(std::uint32_t k) noexcept {
  return {k & 1u, k >> 1 & 1u, k >> 2 & 1u};
}

/// The cell of a point whose coordinates count in cells.
glm::uvec3 cell_of(const glm::dvec3& in_cells, const glm::uvec3& cells) noexcept {
  return glm::uvec3(glm::clamp(glm::floor(in_cells), glm::dvec3(0.0), glm::dvec3(cells - 1u)));
}

std::uint64_t texels_of_row(std::uint64_t vertices) noexcept {
  return (vertices + 1) / 2;
}

std::uint64_t cell_texels(const Grid& grid) noexcept {
  return (grid.cell_count() + 3) / 4;
}

std::uint64_t coarse_texels(const Grid& grid) noexcept {
  return texels_of_row(grid.cells.x + 1) * (grid.cells.y + 1) * (grid.cells.z + 1);
}

/// Appends rows of vertices, each with texels of its own.
void append_rows(std::span<const Vertex> vertices, std::uint32_t row, std::vector<glm::uvec4>& texels) {
  for (std::size_t first = 0; first < vertices.size(); first += row) {
    for (std::uint32_t x = 0; x < row; x += 2) {
      const Vertex& a = vertices[first + x];
      const Vertex b = x + 1 < row ? vertices[first + x + 1] : Vertex{};
      texels.emplace_back(std::bit_cast<std::uint32_t>(a.distance_m), a.gradient,
                          std::bit_cast<std::uint32_t>(b.distance_m), b.gradient);
    }
  }
}

}  // namespace

double blended_distance_m(const Cell& cell, bool is_signed) noexcept {
  double planes_m = 0.0;
  double steps_m = 0.0;
  glm::dvec3 mean_gradient(0.0);
  for (std::uint32_t k = 0; k < 8; ++k) {
    const glm::dvec3 from(corner(k));
    const glm::dvec3 parts = glm::mix(1.0 - cell.at, cell.at, from);
    const double weight = parts.x * parts.y * parts.z;
    const double distance_m = is_signed ? cell.distances_m[k] : std::abs(cell.distances_m[k]);
    const bool turned = !is_signed && cell.distances_m[k] < 0.0;
    const glm::dvec3 gradient = turned ? -cell.gradients[k] : cell.gradients[k];
    const double step_m = glm::dot(gradient, cell.edge_m * (cell.at - from));
    // The side of the vertex' plane on which the point lies.
    const double side = !is_signed && distance_m + step_m < 0.0 ? -1.0 : 1.0;
    planes_m += weight * side * (distance_m + step_m);
    steps_m += weight * side * step_m;
    mean_gradient += weight * side * gradient;
  }
  const double agreement = std::min(1.0, 2.0 * glm::dot(mean_gradient, mean_gradient));
  return planes_m - 0.5 * agreement * steps_m;
}

Cell StoredField::cell_at(const glm::dvec3& point_m) const noexcept {
  const double edge_m = static_cast<double>(grid.cell_m);
  const glm::dvec3 in_cells =
      glm::clamp((point_m - glm::dvec3(grid.origin_m)) / edge_m, glm::dvec3(0.0), glm::dvec3(grid.cells));
  const glm::uvec3 coarse_cell = cell_of(in_cells, grid.cells);
  const std::uint32_t brick = bricks_of_cells[grid.cell_number(coarse_cell)];
  Cell cell;
  const auto take = [&](std::uint32_t k, const Vertex& vertex) {
    cell.distances_m[k] = static_cast<double>(vertex.distance_m);
    cell.gradients[k] = glm::dvec3(gradient_of(vertex));
  };
  if (brick == shared::field_none) {
    cell.edge_m = edge_m;
    cell.at = in_cells - glm::dvec3(coarse_cell);
    for (std::uint32_t k = 0; k < 8; ++k)
      take(k, coarse[grid.vertex_number(coarse_cell + corner(k))]);
    return cell;
  }
  const glm::dvec3 in_brick = static_cast<double>(brick_cells) * (in_cells - glm::dvec3(coarse_cell));
  const glm::uvec3 fine_cell = cell_of(in_brick, glm::uvec3(brick_cells));
  cell.edge_m = edge_m / brick_cells;
  cell.at = in_brick - glm::dvec3(fine_cell);
  for (std::uint32_t k = 0; k < 8; ++k) {
    const glm::uvec3 v = fine_cell + corner(k);
    take(k, bricks[std::size_t{brick} * vertices_per_brick + (v.z * brick_vertices + v.y) * brick_vertices +
                   v.x]);
  }
  return cell;
}

double StoredField::distance_m(const glm::dvec3& point_m) const noexcept {
  return blended_distance_m(cell_at(point_m), false);
}

double StoredField::signed_distance_m(const glm::dvec3& point_m) const noexcept {
  return blended_distance_m(cell_at(point_m), is_signed);
}

bool StoredField::is_in_brick(const glm::dvec3& point_m) const noexcept {
  const glm::dvec3 in_cells = (point_m - glm::dvec3(grid.origin_m)) / static_cast<double>(grid.cell_m);
  if (glm::any(glm::lessThan(in_cells, glm::dvec3(0.0))) ||
      glm::any(glm::greaterThan(in_cells, glm::dvec3(grid.cells))))
    return false;
  return bricks_of_cells[grid.cell_number(cell_of(in_cells, grid.cells))] != shared::field_none;
}

std::uint64_t memory_bytes(const Grid& grid, std::uint64_t bricks) noexcept {
  return 16 * (shared::field_header_texels + cell_texels(grid) + coarse_texels(grid) +
               shared::field_brick_texels * bricks);
}

std::vector<glm::uvec4> device_texels(const StoredField& field, std::uint32_t first) {
  const Grid& grid = field.grid;
  const std::uint32_t cells = first + shared::field_header_texels;
  const auto coarse = static_cast<std::uint32_t>(cells + cell_texels(grid));
  const auto bricks = static_cast<std::uint32_t>(coarse + coarse_texels(grid));
  std::vector<glm::uvec4> texels;
  texels.reserve(memory_bytes(grid, field.bricks.size() / vertices_per_brick) / 16);
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  texels.emplace_back(bits(grid.origin_m.x), bits(grid.origin_m.y), bits(grid.origin_m.z), bits(grid.cell_m));
  texels.emplace_back(grid.cells, field.is_signed ? 1u : 0u);
  texels.emplace_back(cells, coarse, bricks, 0u);
  for (std::size_t i = 0; i < field.bricks_of_cells.size(); i += 4) {
    glm::uvec4 four(shared::field_none);
    for (std::size_t k = 0; k < 4 && i + k < field.bricks_of_cells.size(); ++k)
      four[static_cast<int>(k)] = field.bricks_of_cells[i + k];
    texels.push_back(four);
  }
  append_rows(field.coarse, grid.cells.x + 1, texels);
  append_rows(field.bricks, brick_vertices, texels);
  RTSTDB_ASSERT(16 * texels.size() == memory_bytes(grid, field.bricks.size() / vertices_per_brick),
                "the size of the texels is not that of memory_bytes");
  return texels;
}

}  // namespace rtstdb::field
