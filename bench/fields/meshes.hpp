#pragma once
// Meshes of which the suite builds fields.

#include <string>
#include <vector>

#include <rtstdb/geometry.hpp>

namespace hil::bench {

struct NamedMesh {
  std::string name;
  rtstdb::TriangleMesh mesh;
};

/// A sphere, a box, a lumpy body, and armadillo, spot, fandisk and bunny, as far as HIL_TEST_DATA has them.
/// If `tiny`, a small sphere and a box.
std::vector<NamedMesh> field_meshes(bool tiny);

double diagonal_m(const rtstdb::TriangleMesh& mesh);

}  // namespace hil::bench
