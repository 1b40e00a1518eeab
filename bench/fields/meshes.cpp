#include "bench/fields/meshes.hpp"

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>

#include <cstdlib>
#include <filesystem>

#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

std::vector<NamedMesh> field_meshes(bool tiny) {
  std::vector<NamedMesh> meshes{{"sphere", rtstdb::make_sphere(1.0, tiny ? 2 : 4)},
                                {"box", rtstdb::make_box({1.0, 1.4, 2.0})}};
  if (tiny) return meshes;
  meshes.push_back({"lumpy_body", lumpy_body(257, 256, 1)});
  const char* const data = std::getenv("HIL_TEST_DATA");
  if (data == nullptr) return meshes;
  for (const char* const name : {"armadillo", "spot", "fandisk", "stanford-bunny"}) {
    const auto path = std::filesystem::path(data) / "meshes" / (std::string(name) + ".obj");
    if (std::filesystem::exists(path)) meshes.push_back({name, must(rtstdb::load_mesh(path))});
  }
  return meshes;
}

double diagonal_m(const rtstdb::TriangleMesh& mesh) {
  const rtstdb::Bounds box = rtstdb::bounds_of(mesh);
  return glm::distance(glm::dvec3(box.minimum_m), glm::dvec3(box.maximum_m));
}

}  // namespace hil::bench
