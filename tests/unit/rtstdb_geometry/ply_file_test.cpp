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

/// The words with which the file is refused; empty when it is not.
std::string refusal(const std::string& bytes) {
  try {
    read_ply(bytes, 1.0);
  } catch (const std::runtime_error& fault) {
    return fault.what();
  }
  return {};
}

TEST(ReadPly, PassesOverWhatIsNoGeometry) {
  const TriangleMesh mesh = read_ply(
      text_ply(
          "comment made by hand\nobj_info none\nelement vertex 4\nproperty uchar red\nproperty double x\n"
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

TEST(ReadPly, ReadsFacesThatStandBeforeTheirPositions) {
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

TEST(ReadPly, SaysWhereTheHeaderIsWrong) {
  EXPECT_NE(refusal("poem\n").find("line 1: the first line is not 'ply'"), std::string::npos);
  EXPECT_NE(refusal("ply\nformat ascii 1.0\n").find("line 3: the file ends within the header"),
            std::string::npos);
  EXPECT_NE(refusal("ply\nend_header\n").find("without a format"), std::string::npos);
  EXPECT_NE(refusal("ply\nformat ascii 2.0\nend_header\n").find("line 2: a format that is neither"),
            std::string::npos);
  EXPECT_NE(refusal(text_ply("elephant\n", "")).find("line 3: unknown word 'elephant'"), std::string::npos);
  EXPECT_NE(refusal(text_ply("element vertex many\n", "")).find("'many' is not a count"), std::string::npos);
  EXPECT_NE(refusal(text_ply("element vertex -1\n", "")).find("'-1' is not a count"), std::string::npos);
  EXPECT_NE(refusal(text_ply("property float x\n", "")).find("before the first element"), std::string::npos);
  EXPECT_NE(refusal(text_ply("element vertex 1\nproperty half x\n", "")).find("unknown type 'half'"),
            std::string::npos);
  EXPECT_NE(refusal(text_ply("element face 1\nproperty list float int a\n", "")).find("not an integer type"),
            std::string::npos);
}

TEST(ReadPly, SaysWhatIsWrongWithTheData) {
  const std::string face_element = "element face 1\nproperty list uchar int vertex_indices\n";
  const auto with_face = [&](const std::string& face) {
    return refusal(text_ply(vertex_element + face_element, square + face));
  };
  EXPECT_EQ(with_face("3 0 1 2"), "");
  EXPECT_NE(with_face("3 0 1").find("ends before its data"), std::string::npos);
  EXPECT_NE(with_face("3 0 1 4").find("corner index 4, and the count of positions is 4"), std::string::npos);
  EXPECT_NE(with_face("3 0 1 -1").find("no corner index"), std::string::npos);
  EXPECT_NE(with_face("3 0 1 1.5").find("no corner index"), std::string::npos);
  EXPECT_NE(with_face("-3 0 1 2").find("no count of a list"), std::string::npos);
  EXPECT_NE(with_face("nan 0 1 2").find("no count of a list"), std::string::npos);
  EXPECT_NE(with_face("3 0 1 two").find("no number"), std::string::npos);
  EXPECT_NE(with_face("3 0 1 2x").find("no number"), std::string::npos);
}

TEST(ReadPly, RefusesDataBehindTheLastElement) {
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
  EXPECT_NE(refusal(binary + '\2').find("(vertex 1) end here, and the file has 1 more byte"),
            std::string::npos);
}

TEST(ReadPly, ReadsLinesThatEndWithACarriageReturn) {
  std::string text = text_ply(vertex_element + "element face 1\nproperty list uchar int vertex_indices\n",
                              square + "3 0 1 2\n");
  std::replace(text.begin(), text.end(), '\n', '\r');
  EXPECT_EQ(read_ply(text, 1.0).triangles, (std::vector<glm::uvec3>{{0, 1, 2}}));
}

TEST(ReadPly, IsNotTakenInByHugeCounts) {
  const std::string huge = "18446744073709551615";
  EXPECT_NE(refusal(text_ply("element vertex " + huge + "\nproperty float x\n", "1 2 3")).find("ends before"),
            std::string::npos);
  EXPECT_NE(refusal(text_ply("element face 1\nproperty list uint int vertex_indices\n", "4294967295 1 2"))
                .find("ends before"),
            std::string::npos);
  // Of elements without properties any number takes no room and no time.
  EXPECT_EQ(refusal(text_ply("element nothing " + huge + "\n", "")), "");
}

}  // namespace
}  // namespace rtstdb
