#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include <rtstdb/geometry.hpp>

#include "mesh_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb {
namespace {

using hil::tests::TemporaryFolder;
using mesh_files::soup;

constexpr const char* plain_node = R"([{"mesh":0}])";

/// Its coordinates are the same as text and as floats.
TriangleMesh body() {
  TriangleMesh mesh = make_box({2.0, 4.0, 0.5});
  mesh.positions_m[7] += glm::vec3(0.25f, 0.5f, 1.0f);  // without symmetry
  return mesh;
}

TriangleMesh moved(TriangleMesh mesh, const glm::mat3& linear, const glm::vec3& offset) {
  for (glm::vec3& p : mesh.positions_m)
    p = linear * p + offset;
  if (glm::determinant(linear) < 0.0f) {
    for (glm::uvec3& t : mesh.triangles)
      t = {t.x, t.z, t.y};
  }
  return mesh;
}

void expect_loads_as(const std::filesystem::path& file, const TriangleMesh& expected, double scale = 1.0) {
  const Result<TriangleMesh> loaded = load_mesh(file, scale);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(soup(loaded.value()), soup(expected));
}

TEST(LoadMesh, ReadsEachFormat) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = body();
  expect_loads_as(folder.write("body.obj", mesh_files::obj(mesh)), mesh);
  expect_loads_as(folder.write("text.stl", mesh_files::ascii_stl(mesh)), mesh);
  expect_loads_as(folder.write("binary.stl", mesh_files::binary_stl(mesh)), mesh);
  expect_loads_as(folder.write("text.ply", mesh_files::ascii_ply(mesh)), mesh);
  expect_loads_as(folder.write("binary.ply", mesh_files::binary_ply(mesh)), mesh);
  expect_loads_as(folder.write("body.gltf", mesh_files::gltf(mesh, plain_node)), mesh);
  expect_loads_as(folder.write("body.glb", mesh_files::glb(mesh, plain_node)), mesh);
}

TEST(LoadMesh, IgnoresTheCaseOfTheExtensionAndReadsPathsWithBlanks) {
  const TemporaryFolder folder;
  expect_loads_as(folder.write("A Body.ObJ", mesh_files::obj(body())), body());
  expect_loads_as(folder.write("k\xc3\xb6rper.STL", mesh_files::binary_stl(body())), body());
}

TEST(LoadMesh, MultipliesByTheScale) {
  const TemporaryFolder folder;
  const TriangleMesh expected = moved(body(), glm::mat3(0.5f), glm::vec3(0.0f));
  expect_loads_as(folder.write("body.obj", mesh_files::obj(body())), expected, 0.5);
}

TEST(LoadMesh, TriangulatesPolygonsAndDropsPointsAndLines) {
  const TemporaryFolder folder;
  const std::string text =
      "v 0 0 0\nv 4 0 0\nv 4 2 0\nv 2 3 0\nv 0 2 0\nv 9 9 9\n"
      "f 1 2 3 4 5\nl 1 6\np 6\n";
  const Result<TriangleMesh> loaded = load_mesh(folder.write("house.obj", text));
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded.value().triangles.size(), 3u);
  double area_m2 = 0.0;
  for (const glm::uvec3& t : loaded.value().triangles) {
    const glm::vec3& a = loaded.value().positions_m[t.x];
    const glm::vec3 twice =
        glm::cross(loaded.value().positions_m[t.y] - a, loaded.value().positions_m[t.z] - a);
    EXPECT_GT(twice.z, 0.0f);
    area_m2 += 0.5 * static_cast<double>(twice.z);
  }
  EXPECT_DOUBLE_EQ(area_m2, 10.0);
  EXPECT_EQ(bounds_of(loaded.value()).maximum_m, glm::vec3(4.0f, 3.0f, 0.0f));
}

TEST(LoadMesh, JoinsAllMeshesOfAFile) {
  const TemporaryFolder folder;
  const std::string text =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\no first\nf 1 2 3\n"
      "v 5 0 0\nv 6 0 0\nv 5 1 0\no second\nusemtl absent\nf 4 5 6\n";
  const TriangleMesh both{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}},
                          {{0, 1, 2}, {3, 4, 5}}};
  expect_loads_as(folder.write("two.obj", text), both);
}

TEST(LoadMesh, AppliesTheTransformsOfNestedNodes) {
  // Outer: turned by 90 degrees about z, then moved. Inner: scaled by 2 along x.
  const std::string nodes =
      R"([{"translation":[10,20,30],"rotation":[0,0,0.70710678118654752,0.70710678118654752],
      "children":[1]},{"mesh":0,"scale":[2,1,1]}])";
  const glm::mat3 linear(0.0f, 2.0f, 0.0f, -1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 1.0f);
  const TriangleMesh expected = moved(body(), linear, {10.0f, 20.0f, 30.0f});
  const TemporaryFolder folder;
  for (const std::filesystem::path file : {folder.write("nested.gltf", mesh_files::gltf(body(), nodes)),
                                           folder.write("nested.glb", mesh_files::glb(body(), nodes))}) {
    const Result<TriangleMesh> loaded = load_mesh(file);
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    ASSERT_EQ(loaded.value().triangles.size(), expected.triangles.size());
    for (std::size_t i = 0; i < expected.triangles.size(); ++i) {
      for (int corner = 0; corner < 3; ++corner) {
        const glm::vec3 p = loaded.value().positions_m[loaded.value().triangles[i][corner]];
        EXPECT_LT(glm::length(p - expected.positions_m[expected.triangles[i][corner]]), 1e-5f);
      }
    }
  }
}

TEST(LoadMesh, PlacesAMeshOncePerNode) {
  const std::string nodes = R"([{"children":[1,2]},{"mesh":0},{"mesh":0,"translation":[0,0,8]}])";
  const TemporaryFolder folder;
  const Result<TriangleMesh> loaded = load_mesh(folder.write("twice.gltf", mesh_files::gltf(body(), nodes)));
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded.value().triangles.size(), 24u);
  EXPECT_EQ(bounds_of(loaded.value()).minimum_m.z, -0.25f);
  EXPECT_EQ(bounds_of(loaded.value()).maximum_m.z, 9.25f);
}

TEST(LoadMesh, KeepsFrontsOutsideUnderAMirroredNode) {
  const std::string nodes = R"([{"mesh":0,"scale":[-1,1,1]}])";
  const TemporaryFolder folder;
  const glm::mat3 mirror(-1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f);
  expect_loads_as(folder.write("mirrored.gltf", mesh_files::gltf(body(), nodes)),
                  moved(body(), mirror, glm::vec3(0.0f)));
}

}  // namespace
}  // namespace rtstdb
