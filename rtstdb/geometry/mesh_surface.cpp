#include "rtstdb/geometry/mesh_surface.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

namespace rtstdb {

Corners corners_of(const MeshView& mesh, std::uint32_t triangle) {
  const glm::uvec3& t = mesh.triangles[triangle];
  return {glm::dvec3(mesh.positions_m[t.x]), glm::dvec3(mesh.positions_m[t.y]),
          glm::dvec3(mesh.positions_m[t.z])};
}

Bounds box_of(const MeshView& mesh) {
  const glm::vec3 first_m = mesh.positions_m[mesh.triangles.front().x];
  Bounds box{first_m, first_m};
  for (const glm::uvec3& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      box.minimum_m = glm::min(box.minimum_m, mesh.positions_m[triangle[i]]);
      box.maximum_m = glm::max(box.maximum_m, mesh.positions_m[triangle[i]]);
    }
  }
  return box;
}

double diagonal_m(const Bounds& box) {
  return glm::distance(glm::dvec3(box.minimum_m), glm::dvec3(box.maximum_m));
}

double distance_to_mesh_m(const MeshView& mesh, const glm::dvec3& p_m) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    nearest_m = std::min(nearest_m, distance_to_triangle_m(corners_of(mesh, t), p_m));
  return nearest_m;
}

double distance_to_triangle_m(const Corners& corners, const glm::dvec3& p_m) {
  const auto& [a, b, c] = corners;
  const auto to_edge = [&](const glm::dvec3& from, const glm::dvec3& to) {
    const glm::dvec3 edge = to - from;
    const double along = glm::dot(p_m - from, edge) / std::max(glm::dot(edge, edge), 1e-300);
    return glm::distance(p_m, from + std::clamp(along, 0.0, 1.0) * edge);
  };
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double nn = glm::dot(n, n);
  const bool is_above = nn > 0.0 && glm::dot(glm::cross(b - a, p_m - a), n) >= 0.0 &&
                        glm::dot(glm::cross(c - b, p_m - b), n) >= 0.0 &&
                        glm::dot(glm::cross(a - c, p_m - c), n) >= 0.0;
  if (is_above) return std::abs(glm::dot(p_m - a, n)) / std::sqrt(nn);
  return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

void append_samples(const Corners& corners, double spacing_m, std::vector<glm::dvec3>& points_m) {
  // Rows parallel to the longest edge, from it to the corner opposite.
  int longest = 0;
  const auto edge_m = [&](int i) { return corners[(i + 1) % 3] - corners[i]; };
  for (int i = 1; i < 3; ++i)
    if (glm::length(edge_m(i)) > glm::length(edge_m(longest))) longest = i;
  const glm::dvec3 begin_m = corners[longest], along_m = edge_m(longest);
  const glm::dvec3 to_top_m = corners[(longest + 2) % 3] - begin_m;
  const double length_m = glm::length(along_m);
  const double height_m = glm::length(glm::cross(along_m, to_top_m)) / std::max(length_m, 1e-300);
  const auto steps_of = [&](double side_m) {
    return static_cast<std::uint64_t>(std::ceil(side_m / spacing_m));
  };
  const auto share = [](std::uint64_t step, std::uint64_t steps) {
    return steps > 0 ? static_cast<double>(step) / static_cast<double>(steps) : 0.0;
  };
  const std::uint64_t rows = steps_of(height_m);
  for (std::uint64_t row = 0; row <= rows; ++row) {
    const double up = share(row, rows);
    const std::uint64_t columns = steps_of((1.0 - up) * length_m);
    for (std::uint64_t column = 0; column <= columns; ++column) {
      const double across = share(column, columns);
      points_m.push_back(begin_m + up * to_top_m + (1.0 - up) * across * along_m);
    }
  }
  if (rows == 0) points_m.push_back(begin_m + to_top_m);
}

MeshSurface::MeshSurface(const MeshView& mesh, double reach_m) : mesh_(mesh), reach_m_(reach_m) {
  std::vector<char> is_taken(mesh.positions_m.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::uvec3& triangle = mesh.triangles[t];
    for (int i = 0; i < 3; ++i)
      if (std::exchange(is_taken[triangle[i]], 1) == 0)
        samples_m_.emplace_back(mesh.positions_m[triangle[i]]);
    const Corners corners = corners_of(mesh, t);
    const double edge_m =
        std::max({glm::distance(corners[0], corners[1]), glm::distance(corners[1], corners[2]),
                  glm::distance(corners[2], corners[0])});
    if (edge_m > 0.5 * reach_m) append_samples(corners, 0.5 * reach_m, samples_m_);
  }
  for (std::uint32_t i = 0; i < samples_m_.size(); ++i)
    samples_of_[cell_of(samples_m_[i])].push_back(i);
}

std::size_t MeshSurface::CellHash::operator()(const Cell& cell) const noexcept {
  const auto part = [](std::int64_t value) { return static_cast<std::uint64_t>(value); };
  return (part(cell[0]) * 0x9E3779B97F4A7C15u) ^ (part(cell[1]) * 0xC2B2AE3D27D4EB4Fu) ^
         (part(cell[2]) * 0x165667B19E3779F9u);
}

MeshSurface::Cell MeshSurface::cell_of(const glm::dvec3& p_m) const noexcept {
  const glm::dvec3 cell = glm::floor(p_m / reach_m_);
  return {static_cast<std::int64_t>(cell.x), static_cast<std::int64_t>(cell.y),
          static_cast<std::int64_t>(cell.z)};
}

bool MeshSurface::is_within_reach(const glm::dvec3& p_m) const {
  const Cell at = cell_of(p_m);
  for (int i = 0; i < 27; ++i) {
    const auto found = samples_of_.find({at[0] + i % 3 - 1, at[1] + i / 3 % 3 - 1, at[2] + i / 9 - 1});
    if (found == samples_of_.end()) continue;
    for (const std::uint32_t sample : found->second)
      if (glm::distance(samples_m_[sample], p_m) <= reach_m_) return true;
  }
  return distance_to_mesh_m(mesh_, p_m) <= reach_m_;
}

double MeshSurface::winding_number(const glm::dvec3& p_m) const {
  double solid_angle = 0.0;
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
    Corners to = corners_of(mesh_, t);
    for (glm::dvec3& corner : to)
      corner -= p_m;
    const double a = glm::length(to[0]), b = glm::length(to[1]), c = glm::length(to[2]);
    const double volume = glm::dot(to[0], glm::cross(to[1], to[2]));
    const double denominator =
        a * b * c + glm::dot(to[0], to[1]) * c + glm::dot(to[1], to[2]) * a + glm::dot(to[2], to[0]) * b;
    solid_angle += 2.0 * std::atan2(volume, denominator);
  }
  return solid_angle / (4.0 * std::numbers::pi);
}

}  // namespace rtstdb
