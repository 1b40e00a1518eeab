#include "tests/support/field_meshes.hpp"

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <vector>

#include "rtstdb/geometry/closed_mesh.hpp"

namespace rtstdb::test {
namespace {

void append(TriangleMesh& mesh, const TriangleMesh& part, const glm::vec3& at_m) {
  const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
  for (const glm::vec3& position : part.positions_m)
    mesh.positions_m.push_back(position + at_m);
  for (const glm::uvec3& triangle : part.triangles)
    mesh.triangles.push_back(triangle + first);
}

}  // namespace

TriangleMesh make_plate_with_hole(double size_m, double hole_m, double thickness_m) {
  TriangleMesh mesh;
  // Corners: outer and inner square, above and below, counter-clockwise from the lower left.
  for (const double z : {0.5 * thickness_m, -0.5 * thickness_m}) {
    for (const double half : {0.5 * size_m, 0.5 * hole_m}) {
      for (const auto& [x, y] : {std::array{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
        mesh.positions_m.emplace_back(half * x, half * y, z);
    }
  }
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.emplace_back(a, b, c);
    mesh.triangles.emplace_back(a, c, d);
  };
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t next = (i + 1) % 4;
    quad(i, next, 4 + next, 4 + i);            // above
    quad(8 + next, 8 + i, 12 + i, 12 + next);  // below
    quad(8 + i, 8 + next, next, i);            // outer side
    quad(12 + next, 12 + i, 4 + i, 4 + next);  // inner side
  }
  return mesh;
}

TriangleMesh make_small_station() {
  TriangleMesh mesh = make_cylinder(2.0, 20.0, 48);
  append(mesh, make_sphere(2.5, 3), {0.0f, 0.0f, 14.0f});
  for (const float side : {-1.0f, 1.0f})
    append(mesh, make_box({12.0, 0.005, 4.0}), {8.5f * side, 0.0f, 3.0f});
  append(mesh, make_box({0.3, 0.3, 3.0}), {0.0f, 4.0f, -2.0f});
  return mesh;
}

Result<field::StoredField> build_with_oracle(const TriangleMesh& mesh, const oracle::MeshDistance& distance,
                                             const FieldOptions& options, std::size_t part) {
  auto begun = field::FieldBuild::begin(bounds_of(mesh), is_closed(mesh), options);
  if (!begun) return begun.error();
  field::FieldBuild build = std::move(begun).value();
  std::vector<shared::FieldPoint> points(part);
  std::vector<shared::FieldSample> samples;
  while (const std::size_t count = build.next(points)) {
    samples.clear();
    for (const shared::FieldPoint& wanted : std::span(points).first(count)) {
      const glm::dvec3 point_m(wanted.point_m);
      const oracle::MeshPoint nearest = distance.nearest(point_m);
      const double side = build.needs_sign() && distance.is_inside(point_m) ? -1.0 : 1.0;
      const glm::dvec3 away = point_m - nearest.point_m;
      const auto [a, b, c] = distance.tree().corners(nearest.triangle);
      const glm::dvec3 gradient = nearest.distance_m > 1e-9 ? side * away / nearest.distance_m
                                                            : glm::normalize(glm::cross(b - a, c - a));
      samples.push_back({glm::vec3(gradient), static_cast<float>(side * nearest.distance_m)});
    }
    if (auto taken = build.take(samples); !taken) return taken.error();
  }
  return std::move(build).field();
}

}  // namespace rtstdb::test
