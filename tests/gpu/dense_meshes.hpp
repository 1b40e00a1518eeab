#pragma once
// Meshes that are searched for long, and asking them.

#include <algorithm>

#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {

/// The same triangle `count` times: every ray that meets it has to look at all of them.
inline TriangleMesh pile(std::uint32_t count) {
  return {{{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}}, std::vector<glm::uvec3>(count, {0, 1, 2})};
}

/// Lines, as triangles without area: their boxes are entered, nothing is hit. Each ray finds its own way
/// through.
inline TriangleMesh thicket(Random& random, std::uint32_t count) {
  TriangleMesh mesh{{{100, 100, 0}, {101, 100, 0}, {100, 101, 0}}, {{0, 1, 2}}};
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::dvec3 from_m(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.insert(mesh.positions_m.end(), {from_m, from_m + 5.0 * random.direction()});
    mesh.triangles.emplace_back(first, first + 1, first + 1);
  }
  return mesh;
}

}  // namespace rtstdb::test
