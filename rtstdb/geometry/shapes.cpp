#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>

namespace rtstdb {
namespace {

bool positive(double length_m) {
  return std::isfinite(length_m) && length_m > 0.0;
}

/// A sphere under construction: unit corners in double, so that rounding happens once at the end.
struct UnitSphere {
  std::vector<glm::dvec3> corners;
  std::vector<glm::uvec3> triangles;
};

UnitSphere make_icosahedron() {
  const double g = std::numbers::phi;
  UnitSphere sphere;
  for (const glm::dvec3& corner :
       {glm::dvec3(-1, g, 0), glm::dvec3(1, g, 0), glm::dvec3(-1, -g, 0), glm::dvec3(1, -g, 0),
        glm::dvec3(0, -1, g), glm::dvec3(0, 1, g), glm::dvec3(0, -1, -g), glm::dvec3(0, 1, -g),
        glm::dvec3(g, 0, -1), glm::dvec3(g, 0, 1), glm::dvec3(-g, 0, -1), glm::dvec3(-g, 0, 1)})
    sphere.corners.push_back(glm::normalize(corner));
  sphere.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return sphere;
}

UnitSphere subdivided(const UnitSphere& coarse) {
  UnitSphere fine{coarse.corners, {}};
  fine.triangles.reserve(coarse.triangles.size() * 4);
  // The midpoint of an edge is created once and shared by both triangles, so the surface stays closed.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> midpoints;
  const auto midpoint = [&](std::uint32_t a, std::uint32_t b) {
    const auto next = static_cast<std::uint32_t>(fine.corners.size());
    const auto [place, is_new] = midpoints.try_emplace(std::minmax(a, b), next);
    if (is_new) fine.corners.push_back(glm::normalize(fine.corners[a] + fine.corners[b]));
    return place->second;
  };
  for (const glm::uvec3& t : coarse.triangles) {
    const std::uint32_t ab = midpoint(t.x, t.y);
    const std::uint32_t bc = midpoint(t.y, t.z);
    const std::uint32_t ca = midpoint(t.z, t.x);
    fine.triangles.insert(fine.triangles.end(), {{t.x, ab, ca}, {t.y, bc, ab}, {t.z, ca, bc}, {ab, bc, ca}});
  }
  return fine;
}

}  // namespace

TriangleMesh make_box(const glm::dvec3& size_m) {
  RTSTDB_REQUIRE(positive(size_m.x) && positive(size_m.y) && positive(size_m.z), "make_box",
                 "every size has to be positive and finite");
  TriangleMesh mesh;
  // Corner i: bit 0 is the side along x, bit 1 along y, bit 2 along z.
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 side((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.5 : -0.5, (i & 4) != 0 ? 0.5 : -0.5);
    mesh.positions_m.emplace_back(side * size_m);
  }
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},   // x
                    {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},   // y
                    {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};  // z
  return mesh;
}

TriangleMesh make_cylinder(double radius_m, double height_m, std::uint32_t segments) {
  RTSTDB_REQUIRE(positive(radius_m) && positive(height_m), "make_cylinder",
                 "radius and height have to be positive and finite");
  RTSTDB_REQUIRE(segments >= 3 && segments <= max_triangles_total / 4, "make_cylinder",
                 "segments have to be 3 to max_triangles_total / 4");
  const double top_m = 0.5 * height_m;
  TriangleMesh mesh;
  mesh.positions_m.reserve(std::size_t{segments} * 2 + 2);
  mesh.triangles.reserve(std::size_t{segments} * 4);
  for (std::uint32_t i = 0; i < segments; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / segments;
    const double x_m = radius_m * std::cos(angle);
    const double y_m = radius_m * std::sin(angle);
    mesh.positions_m.emplace_back(glm::dvec3(x_m, y_m, -top_m));
    mesh.positions_m.emplace_back(glm::dvec3(x_m, y_m, top_m));
  }
  const std::uint32_t bottom_center = segments * 2;
  const std::uint32_t top_center = bottom_center + 1;
  mesh.positions_m.emplace_back(glm::dvec3(0.0, 0.0, -top_m));
  mesh.positions_m.emplace_back(glm::dvec3(0.0, 0.0, top_m));
  for (std::uint32_t i = 0; i < segments; ++i) {
    const std::uint32_t bottom = i * 2;
    const std::uint32_t next_bottom = (i + 1) % segments * 2;
    mesh.triangles.insert(mesh.triangles.end(), {{bottom, next_bottom, next_bottom + 1},
                                                 {bottom, next_bottom + 1, bottom + 1},
                                                 {bottom_center, next_bottom, bottom},
                                                 {top_center, bottom + 1, next_bottom + 1}});
  }
  return mesh;
}

TriangleMesh make_sphere(double radius_m, std::uint32_t subdivisions) {
  RTSTDB_REQUIRE(positive(radius_m), "make_sphere", "the radius has to be positive and finite");
  RTSTDB_REQUIRE(subdivisions <= 10, "make_sphere", "subdivisions have to be 0 to 10");
  UnitSphere sphere = make_icosahedron();
  for (std::uint32_t i = 0; i < subdivisions; ++i)
    sphere = subdivided(sphere);
  TriangleMesh mesh;
  mesh.positions_m.reserve(sphere.corners.size());
  for (const glm::dvec3& corner : sphere.corners)
    mesh.positions_m.emplace_back(corner * radius_m);
  mesh.triangles = std::move(sphere.triangles);
  return mesh;
}

TriangleMesh make_rectangle(double size_x_m, double size_y_m) {
  RTSTDB_REQUIRE(positive(size_x_m) && positive(size_y_m), "make_rectangle",
                 "both sizes have to be positive and finite");
  const glm::dvec3 x(0.5 * size_x_m, 0.0, 0.0);
  const glm::dvec3 y(0.0, 0.5 * size_y_m, 0.0);
  TriangleMesh mesh;
  mesh.positions_m = {glm::vec3(-x - y), glm::vec3(x - y), glm::vec3(x + y), glm::vec3(-x + y)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

}  // namespace rtstdb
