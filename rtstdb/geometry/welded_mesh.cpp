#include "rtstdb/geometry/welded_mesh.hpp"

#include <algorithm>
#include <utility>

#include "rtstdb/geometry/has_area.hpp"
#include "rtstdb/geometry/hull_triangles.hpp"
#include "rtstdb/geometry/mesh_surface.hpp"
#include "rtstdb/geometry/welded_corners.hpp"

namespace rtstdb {

WeldedMesh welded(const MeshView& mesh) {
  WeldedMesh result;
  result.diagonal_m = diagonal_m(box_of(mesh));
  const std::vector<std::uint32_t> first = first_at_place(mesh.positions_m);
  std::vector<std::uint32_t> number(mesh.positions_m.size(), no_index);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    glm::uvec3 triangle = mesh.triangles[t];
    for (int i = 0; i < 3; ++i) {
      std::uint32_t& point = number[first[triangle[i]]];
      if (point == no_index) {
        point = static_cast<std::uint32_t>(result.points_m.size());
        result.points_m.push_back(mesh.positions_m[triangle[i]]);
      }
      triangle[i] = point;
    }
    if (!has_area(result.points_m[triangle.x], result.points_m[triangle.y], result.points_m[triangle.z]))
      continue;
    result.triangles.push_back(triangle);
    result.numbers.push_back(t);
  }
  return result;
}

void remove_repeated(WeldedMesh& mesh) {
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> order;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<std::uint32_t, 3> corners{mesh.triangles[t].x, mesh.triangles[t].y, mesh.triangles[t].z};
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    order.emplace_back(corners, t);
  }
  std::ranges::sort(order);
  std::vector<std::uint32_t> unique;
  for (std::size_t i = 0; i < order.size(); ++i)
    if (i == 0 || order[i].first != order[i - 1].first) unique.push_back(order[i].second);
  if (unique.size() == order.size()) return;
  std::ranges::sort(unique);
  for (std::size_t i = 0; i < unique.size(); ++i) {
    mesh.triangles[i] = mesh.triangles[unique[i]];
    mesh.numbers[i] = mesh.numbers[unique[i]];
  }
  mesh.triangles.resize(unique.size());
  mesh.numbers.resize(unique.size());
}

}  // namespace rtstdb
