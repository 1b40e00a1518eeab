// Normals and colours of glTF primitives: types, transforms of nodes, and refusals.

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "rtstdb/geometry/gltf_file.hpp"

namespace rtstdb {
namespace {

template <class T>
void put_all(std::string& bytes, std::initializer_list<T> values) {
  for (const T value : values)
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// What the accessors below name.
std::string attribute_bytes(float last_normal_x = 0.0f, float last_color_x = 1.0f) {
  std::string bytes;
  put_all<float>(bytes, {0, 0, 0, 1, 0, 0, 0, 1, 0});                           // 0: positions
  put_all<float>(bytes, {1, 1, 0, 0, 0, 2, last_normal_x, 0, 0});               // 36: normals
  put_all<float>(bytes, {0.5f, 0, 1, 2, -1, 0.25f, last_color_x, 1, 1});        // 72: colours
  put_all<std::uint8_t>(bytes, {255, 0, 51, 7, 0, 102, 0, 7, 204, 0, 255, 7});  // 108: with alpha
  put_all<std::uint16_t>(bytes,
                         {65535, 0, 13107, 9, 0, 26214, 0, 9, 52428, 0, 65535, 9});  // 120: 8 bytes apart
  return bytes;
}

constexpr const char* attribute_accessors =
    R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
    R"({"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"},)"
    R"({"bufferView":0,"byteOffset":72,"componentType":5126,"count":3,"type":"VEC3"},)"
    R"({"bufferView":0,"byteOffset":108,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"},)"
    R"({"bufferView":1,"componentType":5123,"normalized":true,"count":3,"type":"VEC3"},)"
    R"({"bufferView":0,"byteOffset":108,"componentType":5121,"count":3,"type":"VEC4"},)"
    R"({"bufferView":0,"byteOffset":36,"componentType":5126,"count":2,"type":"VEC3"},)"
    R"({"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"SCALAR"},)"
    R"({"bufferView":0,"byteOffset":132,"componentType":5126,"count":3,"type":"VEC4"},)"
    R"({"bufferView":0,"byteOffset":108,"componentType":5120,"normalized":true,"count":3,"type":"VEC3"})";

std::string primitive_with(const std::string& attributes) {
  return R"({"attributes":{"POSITION":0)" + attributes + "}}";
}

/// `more`: for the file.
std::string file_of(const std::string& primitives, const std::string& node = "",
                    const std::string& more = "") {
  return R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0)" + node +
         R"(}],"meshes":[{"primitives":[)" + primitives +
         R"(]}],"buffers":[{"byteLength":144}],"bufferViews":[)"
         R"({"buffer":0,"byteLength":144},{"buffer":0,"byteOffset":120,"byteLength":24,"byteStride":8}],)"
         R"("accessors":[)" +
         attribute_accessors + "]" + more + "}";
}

TriangleMesh read_attributes(const std::string& json) {
  return read_gltf(json, attribute_bytes(), ".", 1.0).value();
}

std::string attribute_fault(const std::string& json, const std::string& bytes = attribute_bytes()) {
  try {
    read_gltf(json, bytes, ".", 1.0).value();
  } catch (const std::exception& fault) {
    return fault.what();
  }
  return {};
}

void expect_corners(const CornerValues& values, const CornerValues& expected) {
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LT(glm::length(values[i] - expected[i]), 1e-6f)
        << "corner " << i << ": " << values[i].x << ", " << values[i].y << ", " << values[i].z;
}

const float diagonal = std::sqrt(0.5f);
constexpr glm::vec3 up{0, 0, 1};
constexpr CornerValues white_corners{glm::vec3(1.0f), glm::vec3(1.0f), glm::vec3(1.0f)};

/// Normals become unit vectors, and a zero normal that of the triangle.
TEST(GltfAttributes, HaveTheTypesOfTheSpecification) {
  const TriangleMesh mesh = read_attributes(file_of(primitive_with(R"(,"NORMAL":1,"COLOR_0":2)")));
  ASSERT_EQ(mesh.corner_normals.size(), 1u);
  expect_corners(mesh.corner_normals[0], {glm::vec3(diagonal, diagonal, 0), up, up});
  expect_corners(mesh.corner_colors.at(0), {glm::vec3(0.5f, 0, 1), glm::vec3(1, 0, 0.25f), glm::vec3(1)});
  const CornerValues of_integers{glm::vec3(1, 0, 0.2f), glm::vec3(0, 0.4f, 0), glm::vec3(0.8f, 0, 1)};
  for (const char* accessor : {"3", "4"}) {
    SCOPED_TRACE(accessor);
    const TriangleMesh colored =
        read_attributes(file_of(primitive_with(std::string(R"(,"COLOR_0":)") + accessor)));
    expect_corners(colored.corner_colors.at(0), of_integers);
    EXPECT_TRUE(colored.corner_normals.empty());
  }
}

TEST(GltfAttributes, OfOtherPrimitivesAreFilledIn) {
  const std::string plain = primitive_with(""), lit = primitive_with(R"(,"NORMAL":1)"),
                    colored = primitive_with(R"(,"COLOR_0":3)");
  const TriangleMesh mesh = read_attributes(file_of(plain + "," + lit + "," + colored + "," + plain));
  ASSERT_EQ(mesh.corner_normals.size(), 4u);
  ASSERT_EQ(mesh.corner_colors.size(), 4u);
  for (const std::size_t i : {0u, 2u, 3u})
    expect_corners(mesh.corner_normals[i], {up, up, up});
  expect_corners(mesh.corner_normals[1], {glm::vec3(diagonal, diagonal, 0), up, up});
  for (const std::size_t i : {0u, 1u, 3u})
    expect_corners(mesh.corner_colors[i], white_corners);
  EXPECT_EQ(mesh.corner_colors[2][0], glm::vec3(1, 0, 0.2f));
}

TEST(GltfAttributes, NormalsStayPerpendicularUnderATransform) {
  const std::string lit = primitive_with(R"(,"NORMAL":1,"COLOR_0":3)");
  // The surface x + y = const is turned by a scale of 4 along x to x / 4 + y = const.
  const TriangleMesh wide = read_attributes(file_of(lit, R"(,"scale":[4,1,1])"));
  const glm::vec3 steep = glm::normalize(glm::vec3(0.25f, 1, 0));
  expect_corners(wide.corner_normals[0], {steep, up, up});
  // By 90 degrees about z, with a translation, which normals ignore.
  const TriangleMesh turned = read_attributes(
      file_of(lit, R"(,"translation":[5,6,7],"rotation":[0,0,0.70710678118654752,0.70710678118654752])"));
  expect_corners(turned.corner_normals[0], {glm::vec3(-diagonal, diagonal, 0), up, up});
}

/// The triangle is turned around, and its normals and colours with it. Its front stays up for a mirror along
/// x, and points down for one along z.
TEST(GltfAttributes, FollowTheCornersOfAMirroredNode) {
  const std::string lit = primitive_with(R"(,"NORMAL":1,"COLOR_0":3)");
  const TriangleMesh across = read_attributes(file_of(lit, R"(,"scale":[-2,2,2])"));
  EXPECT_EQ(across.positions_m[across.triangles[0].z], glm::vec3(0));
  expect_corners(across.corner_normals[0], {up, up, glm::vec3(-diagonal, diagonal, 0)});
  expect_corners(across.corner_colors[0],
                 {glm::vec3(0.8f, 0, 1), glm::vec3(0, 0.4f, 0), glm::vec3(1, 0, 0.2f)});
  const TriangleMesh down = read_attributes(file_of(lit, R"(,"scale":[1,1,-1])"));
  expect_corners(down.corner_normals[0], {-up, -up, glm::vec3(diagonal, diagonal, 0)});
}

/// The inverse of this scale does not exist.
TEST(GltfAttributes, HaveNormalsUnderAFlatTransform) {
  const std::string lit = primitive_with(R"(,"NORMAL":1)");
  const TriangleMesh flat = read_attributes(file_of(lit, R"(,"scale":[1,1,0])"));
  expect_corners(flat.corner_normals[0], {up, up, up});
  EXPECT_TRUE(validate(flat).ok());
}

TEST(GltfAttributes, AreRefusedWithTheirAccessor) {
  const auto fault = [](const std::string& attributes) {
    return attribute_fault(file_of(primitive_with(attributes)));
  };
  const std::string place = "mesh 0, primitive 0: ";
  EXPECT_EQ(
      fault(R"(,"NORMAL":6)"),
      place + "the count of its NORMAL (accessor 6) is 2, and the count of positions (accessor 0) is 3");
  EXPECT_EQ(
      fault(R"(,"COLOR_0":6)"),
      place + "the count of its COLOR_0 (accessor 6) is 2, and the count of positions (accessor 0) is 3");
  const std::string vectors = "; VEC3 of component type 5126 (float) is allowed";
  EXPECT_EQ(fault(R"(,"NORMAL":7)"),
            place + "its normals (accessor 7) are SCALAR of component type 5126" + vectors);
  EXPECT_EQ(fault(R"(,"NORMAL":4)"),
            place + "its normals (accessor 4) are VEC3 of component type 5123" + vectors);
  const std::string colors =
      "; VEC3 or VEC4 of component type 5126 (float), or 5121 or 5123 and normalized, is allowed";
  EXPECT_EQ(fault(R"(,"COLOR_0":7)"),
            place + "its colours (accessor 7) are SCALAR of component type 5126" + colors);
  EXPECT_EQ(fault(R"(,"COLOR_0":9)"),
            place + "its colours (accessor 9) are VEC3 of component type 5120" + colors);
  EXPECT_EQ(fault(R"(,"COLOR_0":5)"),
            place + "its colours (accessor 5) are VEC4 of component type 5121, not normalized" + colors);
  EXPECT_EQ(
      fault(R"(,"COLOR_0":8)"),
      "accessor 8: 3 elements of 16 bytes, 16 bytes apart, from byte 132 on do not fit into bufferView 0 "
      "of 144 bytes");
  EXPECT_EQ(fault(R"(,"NORMAL":99)"), place + "its NORMAL names entry 99 of accessors, which has 10");
  EXPECT_EQ(fault(R"(,"NORMAL":"one")"), place + "its NORMAL is not a whole number");
}

TEST(GltfAttributes, AreRefusedIfNotFinite) {
  const std::string both = file_of(primitive_with(R"(,"NORMAL":1,"COLOR_0":2)"));
  const std::string place = "mesh 0, primitive 0: ";
  EXPECT_EQ(attribute_fault(both, attribute_bytes(std::nanf(""))),
            place + "NORMAL 2 (accessor 1) is (nan, 0, 0), which is not finite");
  EXPECT_EQ(attribute_fault(both, attribute_bytes(0.0f, HUGE_VALF)),
            place + "COLOR_0 2 (accessor 2) is (inf, 1, 1), which is not finite");
  EXPECT_EQ(attribute_fault(both, attribute_bytes(3e38f)), "");
}

TEST(GltfAttributes, ReportMaterialsAndTexturesApart) {
  const auto report_of = [](const std::string& json) {
    MeshFileReport report{.materials_ignored = true, .textures_ignored = true};
    read_gltf(json, attribute_bytes(), ".", 1.0, &report).value();
    return report;
  };
  const MeshFileReport plain = report_of(file_of(primitive_with("")));
  EXPECT_FALSE(plain.materials_ignored || plain.textures_ignored);
  const MeshFileReport textured = report_of(file_of(primitive_with(""), "", R"(,"textures":[{}])"));
  EXPECT_TRUE(!textured.materials_ignored && textured.textures_ignored);
  const MeshFileReport painted = report_of(file_of(R"({"attributes":{"POSITION":0},"material":0})"));
  EXPECT_TRUE(painted.materials_ignored && !painted.textures_ignored);
}

}  // namespace
}  // namespace rtstdb
