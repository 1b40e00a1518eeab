// The errors of load_mesh for files that are no meshes, or damaged ones.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>

#include "mesh_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb {
namespace {

using hil::tests::TemporaryFolder;

constexpr const char* plain_node = R"([{"mesh":0}])";

void expect_refused(const std::filesystem::path& file, ErrorCode code, const std::string& part,
                    double scale = 1.0) {
  const Result<TriangleMesh> loaded = load_mesh(file, scale);
  ASSERT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.error().code, code);
  const std::string& message = loaded.error().message;
  EXPECT_NE(message.find(file.string()), std::string::npos) << message;
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

class LoadMeshError : public testing::Test {
 protected:
  /// Writes the file and expects ErrorCode::file.
  void expect_file_error(const std::string& name, const std::string& bytes, const std::string& part) const {
    SCOPED_TRACE(part);
    expect_refused(folder.write(name, bytes), ErrorCode::file, part);
  }
  const TemporaryFolder folder;
};

TEST_F(LoadMeshError, IsReportedForMissingFiles) {
  expect_refused(folder.path() / "absent.obj", ErrorCode::file, "does not exist");
  expect_refused(folder.path(), ErrorCode::file, "is a directory");
  expect_file_error("empty.obj", "", "is empty");
  expect_refused("/dev/null", ErrorCode::file, "is not a regular file");
}

TEST_F(LoadMeshError, NamesTheDepthOfJson) {
  expect_file_error("deep.gltf", std::string(200'000, '['),
                    "nests its JSON 200000 levels deep; 100 are read");
  std::string glb = mesh_files::glb(make_box({1.0, 1.0, 1.0}), plain_node);
  const std::string brackets(400'000, '[');
  const auto length = static_cast<std::uint32_t>(brackets.size());
  glb.replace(12, 4, reinterpret_cast<const char*>(&length), 4);
  glb = glb.substr(0, 20) + brackets;
  expect_file_error("deep.glb", glb, "nests its JSON 400000 levels deep");
}

TEST_F(LoadMeshError, IsNotReportedForBracketsInStrings) {
  std::string text = mesh_files::gltf(make_box({1.0, 1.0, 1.0}), plain_node);
  text.insert(text.find('{') + 1, R"("extras":{"note":")" + std::string(500, '[') + R"(\"{{"},)");
  const auto loaded = load_mesh(folder.write("body.gltf", text));
  EXPECT_TRUE(loaded.ok()) << loaded.error().message;
}

/// A face with corners on a circle.
std::string ply_of_polygon(std::uint32_t corners) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(corners) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
                     "property list int int vertex_indices\nend_header\n";
  for (std::uint32_t i = 0; i < corners; ++i)
    text += std::to_string(std::cos(6.28 * i / corners)) + " " +
            std::to_string(std::sin(6.28 * i / corners)) + " 0\n";
  text += "3 0 1 2\n" + std::to_string(corners);
  for (std::uint32_t i = 0; i < corners; ++i)
    text += " " + std::to_string(i);
  return text + "\n";
}

std::string obj_of_polygon(std::uint32_t corners) {
  std::string text, face = "f";
  for (std::uint32_t i = 0; i < corners; ++i) {
    text += "v " + std::to_string(2.5 * std::cos(6.28 * i / corners)) + " " +
            std::to_string(2.5 * std::sin(6.28 * i / corners)) + " 0\n";
    face += " " + std::to_string(i + 1);
  }
  return text + face + "\n";
}

TEST_F(LoadMeshError, LimitsTheCornersOfAPolygon) {
  const auto largest = load_mesh(folder.write("largest.ply", ply_of_polygon(max_polygon_corners)));
  ASSERT_TRUE(largest.ok()) << largest.error().message;
  EXPECT_EQ(largest.value().triangles.size(), max_polygon_corners - 2 + 1);
  expect_file_error("more.ply", ply_of_polygon(max_polygon_corners + 1),
                    "PLY data: face 1 has 4097 corners; up to 4096 are triangulated");
  const auto largest_obj = load_mesh(folder.write("largest.obj", obj_of_polygon(max_polygon_corners)));
  ASSERT_TRUE(largest_obj.ok()) << largest_obj.error().message;
  EXPECT_EQ(largest_obj.value().triangles.size(), max_polygon_corners - 2);
  expect_file_error("more.obj", obj_of_polygon(max_polygon_corners + 1),
                    "has 4097 corners; up to 4096 are triangulated");
}

TEST_F(LoadMeshError, NamesAnUnknownExtension) {
  expect_file_error("body.fbx", "x", "'.fbx'");
  expect_file_error("body", "x", "''");
}

TEST_F(LoadMeshError, IsReportedForAnInvalidScale) {
  const auto file = folder.write("body.obj", mesh_files::obj(make_box({1.0, 1.0, 1.0})));
  for (const double scale : {0.0, -1.0, std::nan(""), HUGE_VAL})
    expect_refused(file, ErrorCode::bad_input, "scale", scale);
}

TEST_F(LoadMeshError, IsReportedForOtherText) {
  for (const char* extension : {"stl", "ply", "gltf", "glb"})
    expect_file_error(std::string("noise.") + extension, "this is not a mesh\n", "can not be read: ");
}

TEST_F(LoadMeshError, IsReportedWithoutTriangles) {
  // The OBJ reader skips unknown lines.
  expect_refused(folder.write("noise.obj", "this is not a mesh\n"), ErrorCode::bad_input, "no triangle");
  for (const std::filesystem::path file :
       {folder.write("cloud.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
        folder.write("cloud.ply",
                     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                     "property float y\nproperty float z\nend_header\n1 2 3\n")}) {
    const Result<TriangleMesh> loaded = load_mesh(file);
    ASSERT_FALSE(loaded.ok());
    EXPECT_NE(loaded.error().message.find(file.string()), std::string::npos) << loaded.error().message;
  }
  expect_refused(folder.write("lines.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\n"), ErrorCode::bad_input,
                 "no triangle");
}

/// Skipping a vertex would shift the indices of all later ones.
TEST_F(LoadMeshError, NamesAnInvalidObjVertex) {
  const auto refused = [&](const std::string& text, const std::string& part) {
    expect_file_error("body.obj", text, part);
  };
  const std::string rest = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\n";
  for (const char* vertex : {"v 0 0 abc", "v 0 0", "v", "v 0,5 0 0", "v nan 0 0", "v 1e999 0 0",
                             "v 1 2 3 4 5 6 7 8", "v 1 2 3 0.5"})
    refused("# made by hand\n" + std::string(vertex) + "\n" + rest, "line 2: '" + std::string(vertex) + "'");
  refused(rest + "f 1 2 5\n",
          "line 6: 'f 1 2 5' has a corner '5'; the count of vertices is 4, and 4 come before it");
  refused(rest + "f 1 2 0\n", "corner '0'");
  refused(rest + "f 1/1 2// x\n", "corner 'x'");
  refused("f -1 -2 -3\n" + rest, "line 1: 'f -1 -2 -3' has a corner '-1'");
}

/// A face with fewer than three corners is not skipped.
TEST_F(LoadMeshError, NamesAFaceWithoutThreeCorners) {
  const std::string rest = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const char* face : {"f", "f 1", "f 1/1 2/2"})
    expect_file_error("body.obj", rest + face + "\n", "line 5: '" + std::string(face) + "' has ");
  expect_file_error("body.obj", rest + "f\n", "has 0 corners; a face has three or more");
  expect_file_error("body.obj", rest + "f 1\n", "has 1 corner; a face has three or more");
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  expect_file_error("body.ply", ply + "2 0 1\n", "PLY data: face 1 has 2 corners; a face has three or more");
  expect_file_error("body.ply", ply + "3 0 1 3\n",
                    "PLY data: face 1 has corner index 3, and the count of positions is 3");
}

TEST_F(LoadMeshError, NamesAnStlCountThatContradictsTheSize) {
  const std::string valid = mesh_files::binary_stl(make_box({1.0, 1.0, 1.0}));
  ASSERT_EQ(valid.size(), 84u + 12 * 50);
  const auto with_count = [&](std::uint32_t count) {
    std::string stl = valid;
    stl.replace(80, 4, reinterpret_cast<const char*>(&count), 4);
    return folder.write("body.stl", stl);
  };
  ASSERT_TRUE(load_mesh(with_count(12)).ok());
  expect_refused(with_count(0), ErrorCode::file,
                 "its header gives 0 triangles, for which the file needs 84 bytes, and it has 684");
  expect_refused(with_count(13), ErrorCode::file,
                 "its header gives 13 triangles, for which the file needs 734 bytes, and it has 684");
  expect_refused(with_count(1), ErrorCode::file, "gives 1 triangle, for which");
  expect_refused(
      with_count(0x7FFFFFFF), ErrorCode::file,
      "its header gives 2147483647 triangles, for which the file needs 107374182434 bytes, and it has 684");
  // A binary file may begin with "solid" too.
  std::string solid = valid;
  solid.replace(0, 5, "solid");
  ASSERT_TRUE(load_mesh(folder.write("solid.stl", solid)).ok());
  expect_file_error("solid.stl", solid + "x", "and it has 685");
}

TEST_F(LoadMeshError, NamesADamagedFacetOfATextStl) {
  const std::string begin =
      "solid a b\n facet normal nan 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n";
  const std::string end = "  endloop\n endfacet\nendsolid a b\n";
  const auto valid =
      load_mesh(folder.write("body.stl", begin + "   VERTEX +0 1e0 0\n" + end + "solid\nendsolid\n"));
  ASSERT_TRUE(valid.ok()) << valid.error().message;
  EXPECT_EQ(valid.value().triangles.size(), 1u);
  expect_file_error("body.stl", begin + end, "line 6: 'endloop' is found where 'vertex' is expected");
  expect_file_error("body.stl", begin + "vertex 0 1 zero\n" + end,
                    "line 6: 'zero' is found where a number is expected");
  expect_file_error("body.stl", begin + "vertex 0 1 0\nvertex 0 0 1\n" + end,
                    "line 7: 'vertex' is found where 'endloop' is expected");
  expect_file_error("body.stl", begin, "the file ends where 'vertex' is expected");
  std::string carriage_returns = begin + end;
  std::replace(carriage_returns.begin(), carriage_returns.end(), '\n', '\r');
  expect_file_error("body.stl", carriage_returns, "line 6: 'endloop' is found where 'vertex' is expected");
}

/// A buffer with three corners and three indices for the accessors below.
std::string gltf_of(const std::string& accessors, const std::string& primitive, const std::string& more = "",
                    const std::string& length = "42") {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)" +
         primitive +
         R"(]}],"buffers":[{"byteLength":42,"uri":"data:application/octet-stream;base64,)"
         // (0,0,0) (1,0,0) (0,1,0) as floats, then the indices 0, 1, 2 of two bytes each
         "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA\"}],"
         R"("bufferViews":[{"buffer":0,"byteLength":)" +
         length + R"(}],"accessors":[)" + accessors + "]" + more + "}";
}

constexpr const char* three_positions = R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"})";
constexpr const char* two_positions = R"({"bufferView":0,"componentType":5126,"count":2,"type":"VEC3"})";
constexpr const char* three_indices =
    R"({"bufferView":0,"byteOffset":36,"componentType":5123,"count":3,"type":"SCALAR"})";
constexpr const char* indexed = R"({"attributes":{"POSITION":0},"indices":1})";

TEST_F(LoadMeshError, NamesInvalidGltfAccessors) {
  const auto load = [&](const std::string& text) { return folder.write("body.gltf", text); };
  const std::string comma = ",";
  const auto valid = load_mesh(load(gltf_of(three_positions + comma + three_indices, indexed)));
  ASSERT_TRUE(valid.ok()) << valid.error().message;
  EXPECT_EQ(valid.value().triangles.size(), 1u);
  expect_refused(
      load(gltf_of(two_positions + comma + three_indices, indexed)), ErrorCode::file,
      "mesh 0, primitive 0: index 2 (accessor 1) is 2, and the count of positions (accessor 0) is 2");
  const std::string four_indices =
      R"({"bufferView":0,"byteOffset":36,"componentType":5123,"count":4,"type":"SCALAR"})";
  expect_refused(
      load(gltf_of(three_positions + comma + four_indices, indexed)), ErrorCode::file,
      "accessor 1: 4 elements of 2 bytes, 2 bytes apart, from byte 36 on do not fit into bufferView 0 of 42");
  expect_refused(load(gltf_of(three_positions + comma + three_indices, indexed, "", "43")), ErrorCode::file,
                 "bufferView 0: 43 bytes from byte 0 on do not fit into buffer 0 of 42 bytes");
  expect_refused(load(gltf_of(three_positions, indexed)), ErrorCode::file,
                 "its indices names entry 1 of accessors, which has 1");
  expect_refused(load(gltf_of(two_positions, R"({"attributes":{"POSITION":0}})")), ErrorCode::file,
                 "the count of its corners is 2, which is not a multiple of 3");
  const std::string shorts =
      R"({"bufferView":0,"componentType":5122,"normalized":true,"count":3,"type":"VEC3"})";
  expect_refused(load(gltf_of(shorts, R"({"attributes":{"POSITION":0}})")), ErrorCode::file,
                 "its positions (accessor 0) are VEC3 of component type 5122; VEC3 of component type 5126 "
                 "(float) is allowed");
}

TEST_F(LoadMeshError, NamesARequiredGltfExtension) {
  const auto with = [&](const std::string& extension) {
    return folder.write("body.gltf", gltf_of(three_positions, R"({"attributes":{"POSITION":0}})",
                                             R"(,"extensionsUsed":[")" + extension +
                                                 R"("],"extensionsRequired":[")" + extension + "\"]"));
  };
  for (const char* extension : {"KHR_mesh_quantization", "KHR_draco_mesh_compression", "VENDOR_unknown"})
    expect_refused(with(extension), ErrorCode::file,
                   "it requires the extension '" + std::string(extension) + "', which is not implemented");
  EXPECT_TRUE(load_mesh(with("KHR_materials_unlit")).ok()) << "materials are not read";
}

TEST_F(LoadMeshError, IsNotReportedForUnusualObjLines) {
  const std::string text =
      "#v\r\n  v +0 0 0 # first\r\nv 1e0 0 .0 1 0.5 0.5\r\n\tv 0 1 \\\r\n 0\r\nvn 0 0 1\r\ng some thing\r\nf "
      "1//1 -2 3/2/1\r\n";
  const auto loaded = load_mesh(folder.write("body.obj", text));
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded.value().triangles.size(), 1u);
  EXPECT_EQ(loaded.value().positions_m.size(), 3u);
}

/// The message quotes the line, not the valid file.
TEST_F(LoadMeshError, NamesTheObjLineThatEndsWithACarriageReturn) {
  const std::string text = "v 0 0 0\rv 1 0 0\rv 0 1 \\\r 0\rf 1 2 3\r";
  const auto loaded = load_mesh(folder.write("body.obj", text));
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(loaded.value().triangles.size(), 1u);
  expect_file_error("body.obj", text + "f 1 2\r", "line 6: 'f 1 2' has 2 corners; a face has three or more");
}

/// Lengths whose sum with the position overflows, too.
TEST_F(LoadMeshError, NamesGlbChunksBeyondTheFile) {
  const std::string valid = mesh_files::glb(make_box({1.0, 1.0, 1.0}), plain_node);
  ASSERT_TRUE(load_mesh(folder.write("valid.glb", valid)).ok());
  for (const std::uint32_t length : {0xFFFFFFFFu, 0xFFFFFFF8u, 0xEE6B2800u, 0x7FFFFFFFu}) {
    std::string glb = valid;
    glb.replace(12, 4, reinterpret_cast<const char*>(&length), 4);
    expect_file_error("body.glb", glb, "says " + std::to_string(length) + " bytes");
  }
  std::string longer = valid;
  const auto length = static_cast<std::uint32_t>(valid.size() + 100);
  longer.replace(8, 4, reinterpret_cast<const char*>(&length), 4);
  expect_file_error("longer.glb", longer, "says that it has");
}

TEST_F(LoadMeshError, IsReportedForInvalidCoordinates) {
  TriangleMesh mesh = make_box({1.0, 1.0, 1.0});
  mesh.positions_m[3].y = std::nanf("");
  expect_refused(folder.write("nan.stl", mesh_files::binary_stl(mesh)), ErrorCode::bad_input, "not finite");
  expect_refused(folder.write("nan.glb", mesh_files::glb(mesh, plain_node)), ErrorCode::bad_input,
                 "not finite");
  mesh.positions_m[3].y = 3e7f;
  expect_refused(folder.write("far.ply", mesh_files::binary_ply(mesh)), ErrorCode::bad_input,
                 "beyond the limit");
  expect_refused(folder.write("small.ply", mesh_files::binary_ply(make_box({1.0, 1.0, 1.0}))),
                 ErrorCode::bad_input, "beyond the limit", 1e9);
}

TEST_F(LoadMeshError, IsReportedForAMissingBuffer) {
  std::string text = mesh_files::gltf(make_box({1.0, 1.0, 1.0}), plain_node);
  const std::size_t begin = text.find("data:application");
  text.replace(begin, text.find('"', begin) - begin, "absent.bin");
  expect_file_error("no_buffer.gltf", text, "can not be read: ");
}

/// A truncated or changed file gives a valid mesh or an error that names the file; never an exception.
void expect_mesh_or_refusal(const std::filesystem::path& file) {
  const Result<TriangleMesh> loaded = load_mesh(file);
  if (loaded.ok()) {
    EXPECT_TRUE(validate(loaded.value()).ok());
  } else {
    EXPECT_NE(loaded.error().message.find(file.string()), std::string::npos) << loaded.error().message;
  }
}

class DamagedMesh : public testing::TestWithParam<const char*> {
 protected:
  std::string bytes() const {
    const std::string name = GetParam();
    const TriangleMesh box = make_box({1.0, 2.0, 3.0});
    const TriangleMesh mesh = name.starts_with("attributes") ? mesh_files::with_attributes(box) : box;
    if (name.ends_with(".obj")) return mesh_files::obj(mesh);
    if (name == "text.stl") return mesh_files::ascii_stl(mesh);
    if (name == "binary.stl") return mesh_files::binary_stl(mesh);
    if (name == "text.ply" || name == "attributes_text.ply") return mesh_files::ascii_ply(mesh);
    if (name.ends_with(".ply")) return mesh_files::binary_ply(mesh);
    if (name.ends_with(".gltf")) return mesh_files::gltf(mesh, plain_node);
    return mesh_files::glb(mesh, plain_node);
  }
  TemporaryFolder folder_;
};

TEST_P(DamagedMesh, CutAtAnyByteIsAMeshOrAnError) {
  const std::string valid = bytes();
  for (std::size_t length = 1; length < valid.size(); length += 1 + valid.size() / 200)
    expect_mesh_or_refusal(folder_.write(GetParam(), std::string_view(valid).substr(0, length)));
}

TEST_P(DamagedMesh, ChangedAtAnyByteIsAMeshOrAnError) {
  const std::string valid = bytes();
  std::mt19937 random(7);
  std::uniform_int_distribution<std::size_t> place(0, valid.size() - 1);
  std::uniform_int_distribution<int> value(0, 255);
  for (int i = 0; i < 300; ++i) {
    std::string broken = valid;
    for (int k = 0; k <= i % 3; ++k)
      broken[place(random)] = static_cast<char>(value(random));
    expect_mesh_or_refusal(folder_.write(GetParam(), broken));
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, DamagedMesh,
                         testing::Values("body.obj", "text.stl", "binary.stl", "text.ply", "binary.ply",
                                         "body.gltf", "body.glb", "attributes.obj", "attributes_text.ply",
                                         "attributes_binary.ply", "attributes.gltf", "attributes.glb"),
                         [](const auto& format) {
                           std::string name = format.param;
                           name[name.find('.')] = '_';
                           return name;
                         });

}  // namespace
}  // namespace rtstdb
