// Reading glTF nodes, primitives and versions, and their refusals.

#include "rtstdb/geometry/gltf_file.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "mesh_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb {
namespace {

/// Four corners of a square in z = 0 and the indices 0, 1, 2, 3 of one byte each, in a GLB's binary chunk.
std::string square_bytes() {
  std::string bytes;
  for (const float value : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 1.0f, 1.0f, 0.0f})
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return bytes + std::string("\0\1\2\3", 4);
}

constexpr const char* square_accessors =
    R"("buffers":[{"byteLength":52}],"bufferViews":[{"buffer":0,"byteLength":52}],"accessors":[)"
    R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
    R"({"bufferView":0,"byteOffset":48,"componentType":5121,"count":4,"type":"SCALAR"},)"
    R"({"bufferView":0,"byteOffset":48,"componentType":5121,"count":3,"type":"SCALAR"}])";
constexpr const char* triangle = R"({"attributes":{"POSITION":0},"indices":2})";

std::string gltf_of(const std::string& nodes, const std::string& primitive = triangle,
                    const std::string& scene_nodes = "0", const std::string& asset = R"({"version":"2.0"})") {
  return R"({"asset":)" + asset + R"(,"scenes":[{"nodes":[)" + scene_nodes + R"(]}],"nodes":[)" + nodes +
         R"(],"meshes":[{"primitives":[)" + primitive + "]}]," + square_accessors + "}";
}

Result<TriangleMesh> read(const std::string& json) {
  return read_gltf(json, square_bytes(), ".", 1.0);
}

/// The error for the file; empty without one.
std::string refusal(const std::string& json) {
  try {
    read(json).value();
  } catch (const std::exception& fault) {
    return fault.what();
  }
  return {};
}

/// A chain of `count` nodes, each moved by (1, 0, 0); the last one has the mesh.
std::string chain_of(std::uint32_t count) {
  std::string nodes;
  for (std::uint32_t k = 0; k + 1 < count; ++k)
    nodes += R"({"translation":[1,0,0],"children":[)" + std::to_string(k + 1) + "]},";
  return nodes + R"({"mesh":0})";
}

TEST(ReadGltf, ReadsAnyDepthOfNodes) {
  const std::string text = gltf_of(chain_of(200'001));
  const Result<TriangleMesh> mesh = read(text);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  ASSERT_EQ(mesh.value().triangles.size(), 1u);
  EXPECT_EQ(mesh.value().positions_m[0], glm::vec3(200'000, 0, 0));
}

TEST(ReadGltf, RefusesANodeWithTwoParents) {
  EXPECT_EQ(refusal(gltf_of(R"({"mesh":0,"children":[0]})")),
            "node 0 names node 0, which scene 0 has named; a node has one parent");
  EXPECT_EQ(refusal(gltf_of(R"({"children":[1]},{"children":[2]},{"mesh":0,"children":[1]})")),
            "node 2 names node 1, which node 0 has named; a node has one parent");
  EXPECT_EQ(refusal(gltf_of(R"({"children":[1,1]},{"mesh":0})")),
            "node 0 names node 1, which node 0 has named; a node has one parent");
  // Each level names the next one twice: 2^64 copies of one mesh.
  std::string doubled;
  for (int k = 1; k <= 64; ++k)
    doubled += R"({"children":[)" + std::to_string(k) + "," + std::to_string(k) + "]},";
  EXPECT_NE(refusal(gltf_of(doubled + R"({"mesh":0})")).find("a node has one parent"), std::string::npos);
  EXPECT_EQ(refusal(gltf_of(R"({"mesh":0})", triangle, "0,1")),
            "scene 0 names entry 1 of nodes, which has 1");
  EXPECT_EQ(refusal(gltf_of(R"({"children":["one"]})")),
            "node 0: its list of children is not a whole number");
}

TEST(ReadGltf, RefusesATransformWithoutItsNumbers) {
  const auto node = [](const std::string& transform) { return gltf_of(R"({"mesh":0,)" + transform + "}"); };
  EXPECT_EQ(refusal(node(R"("matrix":[1,0,0])")),
            "node 0: its matrix needs 16 numbers, and the count of those given is 3");
  EXPECT_EQ(refusal(node(R"("translation":[1,0,0,0])")),
            "node 0: its translation needs 3 numbers, and the count of those given is 4");
  EXPECT_EQ(refusal(node(R"("rotation":[0,0,1])")),
            "node 0: its rotation needs 4 numbers, and the count of those given is 3");
  EXPECT_EQ(refusal(node(R"("scale":2)")), "node 0: its scale is not an array of 3 numbers");
  EXPECT_EQ(refusal(node(R"("scale":[1,"2",3])")), "node 0: its scale: element 1 is not a number");
  EXPECT_EQ(refusal(node(R"("rotation":[0,0,0,0])")),
            "node 0: its rotation has the length 0.000000, and a rotation is a unit quaternion");
  EXPECT_EQ(refusal(node(R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,6,7,2])")),
            "node 0: the last row of its matrix is not 0, 0, 0, 1");
}

TEST(ReadGltf, ReadsMatricesByColumns) {
  // (x, y, z) becomes (y + 5, 2 x + 6, z + 7).
  const std::string text = gltf_of(R"({"mesh":0,"matrix":[0,2,0,0,1,0,0,0,0,0,1,0,5,6,7,1]})");
  const Result<TriangleMesh> mesh = read(text);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh.value().positions_m[1], glm::vec3(5, 8, 7));
  EXPECT_EQ(mesh.value().positions_m[2], glm::vec3(6, 6, 7));
}

TEST(ReadGltf, KeepsTheFrontsOfStripsAndFans) {
  const auto normals_up = [](const std::string& primitive) {
    const std::string text = gltf_of(R"({"mesh":0})", primitive);
    const TriangleMesh mesh = read(text).value();
    EXPECT_EQ(mesh.triangles.size(), 2u) << primitive;
    std::vector<bool> up;
    for (const glm::uvec3& t : mesh.triangles)
      up.push_back(glm::cross(mesh.positions_m[t.y] - mesh.positions_m[t.x],
                              mesh.positions_m[t.z] - mesh.positions_m[t.x])
                       .z > 0.0f);
    return up;
  };
  EXPECT_EQ(normals_up(R"({"attributes":{"POSITION":0},"indices":1,"mode":5})"), std::vector<bool>(2, true));
  // Around corner 0, from corner 1 to 2 and back to 3, which is between them.
  EXPECT_EQ(normals_up(R"({"attributes":{"POSITION":0},"mode":6})"), (std::vector<bool>{true, false}));
}

TEST(ReadGltf, RefusesTrianglesWithoutPositions) {
  const std::string fault = "mesh 0, primitive 0 has no attribute POSITION, and its triangles need one";
  EXPECT_EQ(refusal(gltf_of(R"({"mesh":0})", R"({"attributes":{"NORMAL":0},"indices":2})")), fault);
  EXPECT_EQ(refusal(gltf_of(R"({"mesh":0})", R"({"indices":2})")), fault);
  EXPECT_EQ(refusal(gltf_of(R"({"mesh":0})", std::string(triangle) + R"(,{"attributes":{},"mode":1})")), "");
}

/// Without a bufferView all elements are zero, and their count has no limit.
TEST(ReadGltf, RefusesAnAccessorWithoutData) {
  std::string text = gltf_of(R"({"mesh":0})");
  const std::string data = R"({"bufferView":0,"byteOffset":48,"componentType":5121,"count":3)";
  text.replace(text.find(data), data.size(), R"({"componentType":5121,"count":999999999999999)");
  EXPECT_NE(refusal(text).find("accessor 2 has no bufferView"), std::string::npos);
}

TEST(ReadGltf, RefusesABufferShorterThanItsLength) {
  std::string text = gltf_of(R"({"mesh":0})");
  const std::string length = R"({"byteLength":52})";
  text.replace(text.find(length), length.size(), R"({"byteLength":53})");
  EXPECT_EQ(refusal(text), "buffer 0 has 52 bytes, and its byteLength is 53");
}

TEST(ReadGltf, RefusesAnotherVersion) {
  const auto version = [](const std::string& asset) {
    return refusal(gltf_of(R"({"mesh":0})", triangle, "0", asset));
  };
  EXPECT_EQ(version(R"({"version":"3.0"})"), "its asset.version is '3.0'; glTF 2.0 is read");
  EXPECT_EQ(version(R"({"version":"1.0"})"), "its asset.version is '1.0'; glTF 2.0 is read");
  EXPECT_EQ(version(R"({"version":"20"})"), "its asset.version is '20'; glTF 2.0 is read");
  EXPECT_EQ(version("{}"), "it has no asset.version; glTF 2.0 is read");
  EXPECT_EQ(version(R"({"version":"2.1"})"), "");
  EXPECT_EQ(version(R"({"version":2.0})"), "");
}

TEST(ReadGltf, RefusesAGlbOfAnotherVersion) {
  const hil::tests::TemporaryFolder folder;
  const std::string valid = mesh_files::glb(make_box({1.0, 1.0, 1.0}), R"([{"mesh":0}])");
  const auto refused = [&](std::size_t at, std::string_view bytes, const std::string& part) {
    std::string glb = valid;
    glb.replace(at, bytes.size(), bytes);
    const Result<TriangleMesh> loaded = load_mesh(folder.write("body.glb", glb));
    ASSERT_FALSE(loaded.ok());
    EXPECT_NE(loaded.error().message.find(part), std::string::npos) << loaded.error().message;
  };
  refused(4, "\1", "it is GLB version 1; version 2 is read");
  refused(0, "glTG", "it does not begin with 'glTF'");
  refused(16, "JSOM", "it has a first chunk that is not of the type JSON");
}

}  // namespace
}  // namespace rtstdb
