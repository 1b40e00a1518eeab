// The normals and colours that load_mesh reads, and what it reports of the rest of a file.

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <rtstdb/geometry.hpp>
#include <rtstdb/srgb.hpp>

#include "mesh_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb {
namespace {

using hil::tests::TemporaryFolder;

void expect_near(const glm::vec3& value, const glm::vec3& expected, float tolerance = 1e-6f) {
  EXPECT_LT(glm::length(value - expected), tolerance)
      << value.x << ", " << value.y << ", " << value.z << " is not " << expected.x << ", " << expected.y
      << ", " << expected.z;
}

void expect_near(const std::vector<CornerValues>& values, const std::vector<CornerValues>& expected) {
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    SCOPED_TRACE(i);
    for (std::size_t corner = 0; corner < 3; ++corner)
      expect_near(values[i][corner], expected[i][corner]);
  }
}

constexpr glm::vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, white{1, 1, 1};

class MeshAttributes : public testing::Test {
 protected:
  TriangleMesh load(const std::string& name, const std::string& bytes) {
    report_ = {.materials_ignored = true, .textures_ignored = true};
    auto loaded = load_mesh(folder_.write(name, bytes), 1.0, &report_);
    EXPECT_TRUE(loaded.ok()) << loaded.error().message;
    return loaded ? std::move(loaded).value() : TriangleMesh{};
  }
  std::string refusal(const std::string& name, const std::string& bytes) {
    const std::filesystem::path file = folder_.write(name, bytes);
    const auto loaded = load_mesh(file);
    if (loaded) return {};
    const std::string prefix = "mesh file '" + file.string() + "' can not be read: ";
    EXPECT_TRUE(loaded.error().message.starts_with(prefix)) << loaded.error().message;
    return loaded.error().message.substr(std::min(prefix.size(), loaded.error().message.size()));
  }
  TemporaryFolder folder_;
  MeshFileReport report_;
};

TEST_F(MeshAttributes, AreReadFromEachFormat) {
  const TriangleMesh mesh = mesh_files::with_attributes(make_box({2.0, 4.0, 0.5}));
  const std::pair<const char*, std::string> files[] = {
      {"body.obj", mesh_files::obj(mesh)},
      {"text.ply", mesh_files::ascii_ply(mesh)},
      {"binary.ply", mesh_files::binary_ply(mesh)},
      {"body.gltf", mesh_files::gltf(mesh, R"([{"mesh":0}])")},
      {"body.glb", mesh_files::glb(mesh, R"([{"mesh":0}])")}};
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    const TriangleMesh loaded = load(name, bytes);
    expect_near(loaded.corner_normals, mesh.corner_normals);
    expect_near(loaded.corner_colors, mesh.corner_colors);
  }
}

TEST_F(MeshAttributes, AreEmptyIfTheFileHasNone) {
  const TriangleMesh box = make_box({1.0, 1.0, 1.0});
  const std::pair<const char*, std::string> files[] = {{"body.obj", mesh_files::obj(box)},
                                                       {"body.stl", mesh_files::ascii_stl(box)},
                                                       {"body.ply", mesh_files::ascii_ply(box)},
                                                       {"body.glb", mesh_files::glb(box, R"([{"mesh":0}])")}};
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    const TriangleMesh loaded = load(name, bytes);
    EXPECT_TRUE(loaded.corner_normals.empty());
    EXPECT_TRUE(loaded.corner_colors.empty());
  }
}

// ---- OBJ

const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST_F(MeshAttributes, OfAPolygonStayWithItsCorners) {
  const TriangleMesh mesh =
      load("square.obj", square + "vn 3 0 0\nvn 0 2 0\nvn 0 0 1\nvn -1 0 0\nf 1//1 2//2 3//-2 4/7/-1\n");
  ASSERT_EQ(mesh.triangles.size(), 2u);
  const glm::vec3 of_vertex[] = {x, y, z, -x};
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      expect_near(mesh.corner_normals[i][k], of_vertex[mesh.triangles[i][static_cast<int>(k)]]);
}

/// A vertex that a face names twice has the normal of each corner there.
TEST_F(MeshAttributes, OfAVertexMayDifferBetweenCorners) {
  const TriangleMesh mesh =
      load("bent.obj", square + "vn 1 0 0\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n");
  expect_near(mesh.corner_normals, {{x, x, x}, {y, y, y}});
}

TEST_F(MeshAttributes, OfCornersWithoutANormalAreThoseOfTheTriangle) {
  const TriangleMesh mesh = load("partly.obj", square +
                                                   "vn 1 0 0\nvn 0 0 0\nf 1 2 3\nf 3//1 4 1//2\nf 1 4 3\n"
                                                   "f 1 1 2\n");
  expect_near(mesh.corner_normals, {{z, z, z}, {x, z, z}, {-z, -z, -z}, {z, z, z}});
  EXPECT_TRUE(load("zero.obj", square + "vn 0 0 0\nf 1//1 2//1 3//1\n").corner_normals.empty());
}

TEST_F(MeshAttributes, OfObjVerticesAreSrgb) {
  const TriangleMesh mesh =
      load("colour.obj",
           "v 0 0 0\nv 1 0 0 0.5 0 1\nv 1 1 0 0.04 0.2 0.4 0.5\nv 0 1 0\nv 0 2 0 1\nf 1 2 3\nf 3 4 5\n");
  const glm::vec3 second(0.21404114f, 0.0f, 1.0f), third(0.04f / 12.92f, 0.03310477f, 0.13286832f);
  expect_near(mesh.corner_colors, {{white, second, third}, {third, white, white}});
  EXPECT_TRUE(mesh.corner_normals.empty());
}

TEST_F(MeshAttributes, OfObjFilesAreRefusedWithTheirLine) {
  const auto line = [&](const std::string& text) { return refusal("bad.obj", text + "\n"); };
  EXPECT_EQ(line(square + "vn 0 1"), "line 5: 'vn 0 1' is not a normal of three finite numbers");
  EXPECT_EQ(line(square + "vn 0 1 2 3"), "line 5: 'vn 0 1 2 3' is not a normal of three finite numbers");
  EXPECT_EQ(line(square + "vn 0 nan 1"), "line 5: 'vn 0 nan 1' is not a normal of three finite numbers");
  EXPECT_EQ(
      line(square + "vn 0 0 1\nf 1//1 2//2 3//1"),
      "line 6: 'f 1//1 2//2 3//1' has a corner '2//2'; the count of normals is 1, and 1 come before it");
  EXPECT_EQ(
      line(square + "vn 0 0 1\nf 1//-1 2/1/-2 3"),
      "line 6: 'f 1//-1 2/1/-2 3' has a corner '2/1/-2'; the count of normals is 1, and 1 come before it");
  EXPECT_EQ(line(square + "vn 0 0 1\nf 1//0 2 3"),
            "line 6: 'f 1//0 2 3' has a corner '1//0'; the count of normals is 1, and 1 come before it");
  EXPECT_EQ(line("v 0 0 0 1 2"),
            "line 1: 'v 0 0 0 1 2' has 5 numbers; a vertex has 3, 4 with a weight, or 6 or 7 with a colour");
  const std::string range = " has a colour beyond the range of 0 to 1 of red, green and blue";
  EXPECT_EQ(line("v 0 0 0 0 255 0"), "line 1: 'v 0 0 0 0 255 0'" + range);
  EXPECT_EQ(line("v 0 0 0 0 0 -0.1"), "line 1: 'v 0 0 0 0 0 -0.1'" + range);
  EXPECT_EQ(line("v 0 0 0 0 0 inf"),
            "line 1: 'v 0 0 0 0 0 inf' is not a vertex of three to seven finite numbers");
}

// ---- PLY

std::string ply(const std::string& properties, const std::string& data) {
  return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" +
         properties + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" + data +
         "3 0 1 2\n";
}
std::string colored_ply(const std::string& type, const std::string& white_value) {
  return ply("property " + type + " red\nproperty " + type + " green\nproperty " + type + " blue\n",
             "0 0 0 0 0 0\n1 0 0 0 0 " + white_value + "\n0 1 0 " + white_value + " 0 0\n");
}

TEST_F(MeshAttributes, OfPlyVerticesHaveTheRangeOfTheirType) {
  for (const auto& [type, white_value] : {std::pair{"uchar", "255"},
                                          {"uint8", "255"},
                                          {"ushort", "65535"},
                                          {"float", "1"},
                                          {"double", "1.0"}}) {
    SCOPED_TRACE(type);
    expect_near(load("body.ply", colored_ply(type, white_value)).corner_colors, {{glm::vec3(0), z, x}});
  }
  const float half = static_cast<float>(linear_from_srgb(0.5));
  const TriangleMesh mesh = load("half.ply", colored_ply("float", "0.5"));
  expect_near(mesh.corner_colors, {{glm::vec3(0), half * z, half * x}});
}

TEST_F(MeshAttributes, OfPlyFilesAreRefusedWithTheirVertex) {
  const auto fault = [&](const std::string& bytes) { return refusal("bad.ply", bytes); };
  EXPECT_EQ(fault(colored_ply("uchar", "256")),
            "PLY data: vertex 1 has the colour (0, 0, 256), and its blue is 0 to 255");
  EXPECT_EQ(fault(colored_ply("float", "-1")),
            "PLY data: vertex 1 has the colour (0, 0, -1), and its blue is 0 to 1");
  EXPECT_EQ(fault(colored_ply("float", "nan")),
            "PLY data: vertex 1 has the colour (0, 0, nan), and its blue is 0 to 1");
  EXPECT_EQ(fault(colored_ply("int", "1")),
            "PLY header: the vertex property red is of a type that colours do not have; uchar, ushort, float "
            "and double are read");
  const std::string normals = "property float nx\nproperty float ny\nproperty float nz\n";
  EXPECT_EQ(fault(ply(normals, "0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 inf 1\n")),
            "PLY data: vertex 2 has the normal (0, inf, 1), which is not finite");
  EXPECT_EQ(fault(ply("property float ny\n", "0 0 0 1\n1 0 0 1\n0 1 0 1\n")),
            "PLY header: the element vertex lacks nx, nz of its normals");
  EXPECT_EQ(fault(ply("property float red\nproperty float blue\n", "0 0 0 1 1\n1 0 0 1 1\n0 1 0 1 1\n")),
            "PLY header: the element vertex lacks green of its colours");
}

/// The second element has neither normals nor colours.
TEST_F(MeshAttributes, OfASecondPlyElementOfVerticesMayBeAbsent) {
  const TriangleMesh mesh = load(
      "two.ply",
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0 1 0 0 255 0 0\n1 0 0 0 1 0 0 255 0\n0 1 0\n3 0 1 2\n");
  expect_near(mesh.corner_normals, {{x, y, z}});
  expect_near(mesh.corner_colors, {{x, y, white}});
}

// ---- what is left out

TEST_F(MeshAttributes, AreAllThatIsReadOfASurface) {
  load("plain.obj", square + "f 1 2 3\n");
  EXPECT_FALSE(report_.materials_ignored || report_.textures_ignored);
  load("library.obj", "mtllib a.mtl\n" + square + "f 1 2 3\n");
  EXPECT_TRUE(report_.materials_ignored && !report_.textures_ignored);
  load("used.obj", square + "usemtl red\nf 1 2 3\n");
  EXPECT_TRUE(report_.materials_ignored && !report_.textures_ignored);
  load("textured.obj", square + "vt 0 0\nf 1/1 2/1 3/1\n");
  EXPECT_TRUE(!report_.materials_ignored && report_.textures_ignored);
  const std::string triangle = "0 0 0\n1 0 0\n0 1 0\n";
  load("plain.ply", ply("", triangle));
  EXPECT_FALSE(report_.materials_ignored || report_.textures_ignored);
  load("textured.ply", ply("comment TextureFile a.png\n", triangle));
  EXPECT_TRUE(!report_.materials_ignored && report_.textures_ignored);
  std::string with_material = ply("", triangle);
  with_material.insert(with_material.find("element face"),
                       "element material 0\nproperty uchar ambient_red\n");
  load("material.ply", with_material);
  EXPECT_TRUE(report_.materials_ignored && !report_.textures_ignored);
  load("body.stl", mesh_files::binary_stl(make_box({1.0, 1.0, 1.0})));
  EXPECT_FALSE(report_.materials_ignored || report_.textures_ignored);
  load("body.glb", mesh_files::glb(make_box({1.0, 1.0, 1.0}), R"([{"mesh":0}])"));
  EXPECT_TRUE(report_.materials_ignored && report_.textures_ignored);
}

}  // namespace
}  // namespace rtstdb
