// The BLAS of a geometry on the device: each triangle is in one leaf, boxes contain their children, the
// number of nodes is bounded, and each run gives the same bits.

#include <algorithm>
#include <cmath>

#include "rtstdb/accel/build_scratch.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/structure_walk.hpp"

namespace rtstdb::test {
namespace {

class GeometryBlas : public StructureTest {
 protected:
  /// Adds the mesh and checks its tree. Returns the depth.
  std::uint32_t check(const TriangleMesh& mesh);
  double cost_of(const TriangleMesh& mesh);

  Random random_{77};
};

std::uint32_t GeometryBlas::check(const TriangleMesh& mesh) {
  const std::uint32_t geometry = add(mesh);
  // The next tree is behind this one.
  const std::uint32_t next = add(make_box(glm::dvec3(1.0)));
  if (HasFailure()) return 0;
  StructureWalk walk(mesh, read(pool_.nodes()), read(pool_.triangles()));
  walk.visit(root_of(geometry), 1);
  walk.expect_valid();
  EXPECT_EQ(walk.node_count(), root_of(next) - root_of(geometry));
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  EXPECT_LE(walk.node_count(), accel::wide_node_bound(count, shared::blas_always_leaf));
  return walk.depth();
}

double GeometryBlas::cost_of(const TriangleMesh& mesh) {
  const std::uint32_t geometry = add(mesh);
  StructureWalk walk(mesh, read(pool_.nodes()), read(pool_.triangles()));
  const ExactBox root = walk.visit(root_of(geometry), 1);
  return walk.cost(root);
}

/// `corners(i)` returns the corners of triangle i.
TriangleMesh mesh_of(std::uint32_t count,
                     const std::function<std::array<glm::vec3, 3>(std::uint32_t)>& corners) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const glm::vec3& corner : corners(i))
      mesh.positions_m.push_back(corner);
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

TEST_F(GeometryBlas, IsValidForEverySize) {
  std::vector<std::uint32_t> counts{63,   64,   65,   127,  255,  256,  257,  1023,
                                    1024, 1025, 2047, 2048, 2049, 4097, 5000, 20'000};
  for (std::uint32_t i = 1; i <= 40; ++i)
    counts.push_back(i);
  for (const std::uint32_t count : counts) {
    SCOPED_TRACE(count);
    pool_ = accel::GeometryPool::create(device(), 4, submit_).value();
    check(mesh_of(count, [&](std::uint32_t) {
      const glm::vec3 center(random_.vector());
      const float size = std::exp2(-8.0f * static_cast<float>(random_.uniform(0, 1)));
      return std::array{center, center + size * glm::vec3(random_.vector()),
                        center + size * glm::vec3(random_.vector())};
    }));
    if (HasFailure()) return;
  }
}

TEST_F(GeometryBlas, IsValidForDegenerateMeshes) {
  const auto at = [this](const glm::vec3& center, const glm::vec3& size) {
    return std::array{center + size * glm::vec3(random_.vector()),
                      center + size * glm::vec3(random_.vector()),
                      center + size * glm::vec3(random_.vector())};
  };
  struct Case {
    const char* name;
    std::function<std::array<glm::vec3, 3>(std::uint32_t)> corners;
    std::uint32_t max_depth;
  };
  const glm::vec3 one(1.0f, 2.0f, 3.0f);
  const Case cases[] = {
      {"one triangle many times",
       [&](std::uint32_t) {
         return std::array{one, one + glm::vec3(1, 0, 0), one + glm::vec3(0, 1, 0)};
       },
       8},
      {"points",
       [&](std::uint32_t i) {
         const glm::vec3 p(static_cast<float>(i % 100), 0, 0);
         return i == 0 ? std::array{one, one + glm::vec3(1, 0, 0), one + glm::vec3(0, 1, 0)}
                       : std::array{p, p, p};
       },
       12},
      {"one center and many sizes",
       [&](std::uint32_t i) {
         const float size = std::exp2(-0.02f * static_cast<float>(i % 1000));
         return std::array{size * glm::vec3(-1, -1, 0), size * glm::vec3(1, -1, 0),
                           size * glm::vec3(0, 1, 0)};
       },
       24},
      {"ever closer to a corner",
       [&](std::uint32_t i) {
         const float place = std::exp2(-0.02f * static_cast<float>(i));
         return at(glm::vec3(place), glm::vec3(0.1f * place));
       },
       24},
      {"slivers",
       [&](std::uint32_t) { return at(glm::vec3(random_.vector()), glm::vec3(1.0f, 1e-6f, 1e-6f)); }, 16},
      {"huge", [&](std::uint32_t) { return at(glm::vec3(2e4 * random_.vector()), glm::vec3(3e3f)); }, 16},
      {"far from the origin",
       [&](std::uint32_t) { return at(glm::vec3(9e4f, -9e4f, 5e4f), glm::vec3(0.5f)); }, 16},
      {"one far away",
       [&](std::uint32_t i) {
         return at(i == 7 ? glm::vec3(9e4f) : glm::vec3(random_.vector()), glm::vec3(0.01f));
       },
       16},
      {"on a line",
       [&](std::uint32_t i) { return at(glm::vec3(0.01f * static_cast<float>(i), 0, 0), glm::vec3(0.1f)); },
       12},
      {"tiny", [&](std::uint32_t) { return at(glm::vec3(1e-20 * random_.vector()), glm::vec3(1e-21f)); }, 24},
  };
  std::uint32_t deepest = 0;
  for (const Case& test_case : cases) {
    SCOPED_TRACE(test_case.name);
    pool_ = accel::GeometryPool::create(device(), 4, submit_).value();
    const std::uint32_t depth = check(mesh_of(6000, test_case.corners));
    EXPECT_LE(depth, test_case.max_depth);
    deepest = std::max(deepest, depth);
  }
  EXPECT_GT(deepest, shared::blas_levels_recorded) << "no tree needs a second submission";
}

/// All Morton codes are equal, and no box has area.
TEST_F(GeometryBlas, IsValidForAMillionDegenerateTriangles) {
  TriangleMesh mesh = make_box(glm::dvec3(1.0));
  mesh.triangles.resize(1'000'000, glm::uvec3(0, 0, 0));
  EXPECT_LE(check(mesh), 16u);
}

TEST_F(GeometryBlas, IsTheSameInEveryRun) {
  const TriangleMesh mesh = mesh_of(30'000, [&](std::uint32_t i) {
    // Many Morton codes and many boxes are equal.
    const glm::vec3 center(glm::ivec3(glm::dvec3(6.0) * random_.vector()));
    const glm::vec3 other = i % 3 == 0 ? glm::vec3(0.1f) : glm::vec3(random_.vector());
    return std::array{center, center + other, center - other};
  });
  // Two copies in one pool and one in another pool.
  struct Copy {
    std::uint32_t root = 0, end = 0;
    std::size_t first_triangle = 0;
  };
  const auto add_copy = [&](std::size_t first_triangle) {
    const std::uint32_t root = root_of(add(mesh));
    return Copy{root, root_of(add(make_box(glm::dvec3(1.0)))), first_triangle};
  };
  const Copy one = add_copy(0);
  const Copy two = add_copy(mesh.triangles.size() + 12);
  const Words nodes = read(pool_.nodes());
  const Words triangles = read(pool_.triangles());
  pool_ = accel::GeometryPool::create(device(), 4, submit_).value();
  const Copy three = add_copy(0);
  ASSERT_FALSE(HasFailure());
  // Boxes and order; references are relative to the place of the copy.
  const auto boxes_of = [](const Words& words, const Copy& copy) {
    Words boxes;
    for (std::uint32_t node = copy.root; node < copy.end; ++node) {
      const auto begin = words.begin() + 4 * shared::node_texels * static_cast<std::ptrdiff_t>(node);
      boxes.insert(boxes.end(), begin, begin + 16);
    }
    return boxes;
  };
  const auto triangles_of = [&](const Words& words, const Copy& copy) {
    constexpr std::size_t each = 4 * shared::triangle_texels;
    const auto begin = words.begin() + static_cast<std::ptrdiff_t>(each * copy.first_triangle);
    return Words(begin, begin + static_cast<std::ptrdiff_t>(each * mesh.triangles.size()));
  };
  EXPECT_EQ(boxes_of(nodes, one), boxes_of(nodes, two));
  EXPECT_EQ(boxes_of(nodes, one), boxes_of(read(pool_.nodes()), three));
  EXPECT_EQ(triangles_of(triangles, one), triangles_of(triangles, two));
  EXPECT_EQ(triangles_of(triangles, one), triangles_of(read(pool_.triangles()), three));
}

TEST_F(GeometryBlas, HasChildrenInTheSlotsOfTheirDirections) {
  const TriangleMesh mesh = make_sphere(1.0, 5);
  const std::uint32_t geometry = add(mesh);
  StructureWalk walk(mesh, read(pool_.nodes()), read(pool_.triangles()));
  const ExactBox root = walk.visit(root_of(geometry), 1);
  const glm::dvec3 extent = root.hi - root.lo;
  // One inverted axis makes the sum smaller than that.
  EXPECT_GT(walk.slot_gain(), 100.0 * (extent.x + extent.y + extent.z));
}

/// The cost by the surface area heuristic. Without rotations of the tree it is above these limits.
TEST_F(GeometryBlas, IsCheapForRays) {
  EXPECT_LT(cost_of(make_sphere(1.0, 6)), 13.7);
  const TriangleMesh random_triangles = mesh_of(20'000, [&](std::uint32_t) {
    const glm::vec3 center(random_.vector());
    const float size = static_cast<float>(random_.magnitude(0.001, 0.5));
    return std::array{center + size * glm::vec3(random_.vector()),
                      center + size * glm::vec3(random_.vector()),
                      center + size * glm::vec3(random_.vector())};
  });
  EXPECT_LT(cost_of(random_triangles), 32.5);
}

}  // namespace
}  // namespace rtstdb::test
