#include "rtstdb/geometry/ply_file.hpp"

#include <glm/vec3.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace rtstdb {
namespace {

const std::string vertex_element = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const std::string square = "0 0 0\n2 0 0\n2 1 0\n0 1 0\n";

std::string text_ply(const std::string& elements, const std::string& data) {
  return "ply\nformat ascii 1.0\n" + elements + "end_header\n" + data;
}

/// The error for the file; empty without one.
std::string refusal(const std::string& bytes) {
  try {
    read_ply(bytes, 1.0);
  } catch (const std::runtime_error& fault) {
    return fault.what();
  }
  return {};
}

void expect_refused(const std::string& bytes, const std::string& part) {
  EXPECT_NE(refusal(bytes).find(part), std::string::npos) << refusal(bytes) << " lacks " << part;
}

TEST(ReadPly, SkipsOtherElementsAndProperties) {
  const TriangleMesh mesh = read_ply(
      text_ply(
          "comment made by hand\nobj_info none\nelement vertex 4\nproperty uchar intensity\nproperty double "
          "x\n"
          "property float32 y\nproperty list uchar int extra\nproperty float z\nelement camera 1\n"
          "property float focus\nelement nothing 3\nelement face 1\nproperty int flag\n"
          "property list uchar uint vertex_index\nproperty list uchar float texcoord\n",
          "255 0 0 2 7 8 0\n255 2 0 0 0\n255 2 1 1 9 +0.5\n255 0 1 0 -0.5\n35.5\n-1 4 0 1 2 3 2 0.5 0.5\n"),
      10.0);
  ASSERT_EQ(mesh.positions_m.size(), 4u);
  EXPECT_EQ(mesh.positions_m[2], glm::vec3(20, 10, 5));
  EXPECT_EQ(mesh.positions_m[3], glm::vec3(0, 10, -5));
  EXPECT_EQ(mesh.triangles.size(), 2u);
}

TEST(ReadPly, ReadsFacesBeforeTheirPositions) {
  const TriangleMesh mesh =
      read_ply(text_ply("element face 1\nproperty list uchar int vertex_indices\n" + vertex_element,
                        "3 0 1 2\n" + square),
               1.0);
  EXPECT_EQ(mesh.triangles, (std::vector<glm::uvec3>{{0, 1, 2}}));
}

TEST(ReadPly, ReadsEveryTypeInBothByteOrders) {
  const std::string elements =
      "element vertex 3\nproperty short x\nproperty double y\nproperty char z\nproperty ushort skipped\n"
      "element face 1\nproperty list int ushort vertex_indices\n";
  const auto file = [&](const std::string& format, bool big) {
    std::string bytes = "ply\r\nformat " + format + " 1.0\r\n" + elements + "end_header\n";
    const auto put = [&](auto value) {
      std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
      if (big) std::reverse(raw.begin(), raw.end());
      bytes += raw;
    };
    for (int i = 0; i < 3; ++i) {
      put(static_cast<std::int16_t>(-300 * i));
      put(0.25 * i);
      put(static_cast<std::int8_t>(-i));
      put(static_cast<std::uint16_t>(60'000));
    }
    put(std::int32_t{3});
    for (const std::uint16_t index : {std::uint16_t{2}, std::uint16_t{1}, std::uint16_t{0}})
      put(index);
    return bytes;
  };
  for (const bool big : {false, true}) {
    const TriangleMesh mesh = read_ply(file(big ? "binary_big_endian" : "binary_little_endian", big), 1.0);
    EXPECT_EQ(mesh.positions_m, (std::vector<glm::vec3>{{0, 0, 0}, {-300, 0.25f, -1}, {-600, 0.5f, -2}}));
    EXPECT_EQ(mesh.triangles, (std::vector<glm::uvec3>{{2, 1, 0}}));
  }
}

TEST(ReadPly, RefusesInvalidHeaders) {
  expect_refused("poem\n", "line 1: the first line is not 'ply'");
  expect_refused("ply\nformat ascii 1.0\n", "line 3: the file ends within the header");
  expect_refused("ply\nend_header\n", "without a format");
  expect_refused("ply\nformat ascii 2.0\nend_header\n", "line 2: a format that is neither");
  expect_refused(text_ply("elephant\n", ""), "line 3: unknown word 'elephant'");
  expect_refused(text_ply("element vertex many\n", ""), "'many' is not a count");
  expect_refused(text_ply("element vertex -1\n", ""), "'-1' is not a count");
  expect_refused(text_ply("property float x\n", ""), "before the first element");
  expect_refused(text_ply("element vertex 1\nproperty half x\n", ""), "unknown type 'half'");
  expect_refused(text_ply("element face 1\nproperty list float int a\n", ""), "not an integer type");
}

TEST(ReadPly, RefusesInvalidData) {
  const std::string face_element = "element face 1\nproperty list uchar int vertex_indices\n";
  const auto with_face = [&](const std::string& face) {
    return refusal(text_ply(vertex_element + face_element, square + face));
  };
  const auto expect_face_refused = [&](const std::string& face, const std::string& part) {
    EXPECT_NE(with_face(face).find(part), std::string::npos) << with_face(face) << " lacks " << part;
  };
  EXPECT_EQ(with_face("3 0 1 2"), "");
  expect_face_refused("3 0 1", "ends before its data");
  expect_face_refused("3 0 1 4", "corner index 4, and the count of positions is 4");
  expect_face_refused("3 0 1 -1", "no corner index");
  expect_face_refused("3 0 1 1.5", "no corner index");
  expect_face_refused("-3 0 1 2", "no count of a list");
  expect_face_refused("nan 0 1 2", "no count of a list");
  expect_face_refused("3 0 1 two", "no number");
  expect_face_refused("3 0 1 2x", "no number");
}

TEST(ReadPly, RefusesDataAfterTheLastElement) {
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string one = text_ply(vertex_element + faces, square + "3 0 1 2\n");
  EXPECT_EQ(refusal(one + " \r\n\n"), "");
  EXPECT_EQ(
      refusal(one + "3 0 2 3\n"),
      "PLY data, byte " + std::to_string(one.size() - 1) +
          ": the elements that the header counts (vertex 4, face 1) end here, and the file has 8 more bytes");
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nend_header\n";
  binary += '\1';
  EXPECT_EQ(refusal(binary + "\n"), "") << "some programs end a binary file with a line end";
  expect_refused(binary + '\2', "(vertex 1) end here, and the file has 1 more byte");
}

TEST(ReadPly, ReadsLinesThatEndWithACarriageReturn) {
  std::string text = text_ply(vertex_element + "element face 1\nproperty list uchar int vertex_indices\n",
                              square + "3 0 1 2\n");
  std::replace(text.begin(), text.end(), '\n', '\r');
  EXPECT_EQ(read_ply(text, 1.0).triangles, (std::vector<glm::uvec3>{{0, 1, 2}}));
}

TEST(ReadPly, RefusesHugeCountsBeforeAllocating) {
  const std::string huge = "18446744073709551615";
  expect_refused(text_ply("element vertex " + huge + "\nproperty float x\n", "1 2 3"), "ends before");
  expect_refused(text_ply("element face 1\nproperty list uint int vertex_indices\n", "4294967295 1 2"),
                 "ends before");
  // Elements without properties take no memory and no time.
  EXPECT_EQ(refusal(text_ply("element nothing " + huge + "\n", "")), "");
}

}  // namespace
}  // namespace rtstdb
