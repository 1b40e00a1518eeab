#pragma once
// Meshes whose search takes many rounds.

#include <algorithm>
#include <cstdint>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {

/// One triangle `count` times: each ray that hits it tests all of them.
inline TriangleMesh repeated_triangle(std::uint32_t count) {
  return {{{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}}, std::vector<glm::uvec3>(count, {0, 1, 2})};
}

/// Triangles without area: rays visit their boxes and hit nothing, each ray by its own path.
inline TriangleMesh random_lines(Random& random, std::uint32_t count) {
  TriangleMesh mesh{{{100, 100, 0}, {101, 100, 0}, {100, 101, 0}}, {{0, 1, 2}}};
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::dvec3 from_m(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.insert(mesh.positions_m.end(), {from_m, from_m + 5.0 * random.direction()});
    mesh.triangles.emplace_back(first, first + 1, first + 1);
  }
  return mesh;
}

/// Thin closed prisms, one above the other: the nearest is soon found, but counting crossings for a sign
/// visits all.
inline TriangleMesh stacked_prisms(std::uint32_t count) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    const float height = 0.01f * static_cast<float>(i);
    for (const float up : {0.0f, 0.005f})
      mesh.positions_m.insert(mesh.positions_m.end(),
                              {{-1, -1, height + up}, {1, -1, height + up}, {0, 2, height + up}});
    const glm::uvec3 faces[] = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                                {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
    for (const glm::uvec3& face : faces)
      mesh.triangles.push_back(first + face);
  }
  return mesh;
}

}  // namespace rtstdb::test
