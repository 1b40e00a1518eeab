// Files of meshes with everything that a mesh may have.

#include "rtstdb/log/geometry_file.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "rtstdb/log/bytes.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
namespace {

constexpr std::uint64_t file_database = 0x51;
constexpr const char* file_name = "geometry.0000000007";

TriangleMesh mesh_with(bool normals, bool colors) {
  TriangleMesh mesh = make_box({1.0, 2.0, 3.0});
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto number = static_cast<float>(i);
    if (normals) mesh.corner_normals.push_back({glm::vec3(number, 1, 0), glm::vec3(0, 0, -2), glm::vec3(1)});
    if (colors) mesh.corner_colors.push_back({glm::vec3(number / 16, 1, 0), glm::vec3(0), glm::vec3(1)});
  }
  return mesh;
}

GeometryOptions options_with(bool parts, bool solid) {
  GeometryOptions options;
  if (parts) options.convex_parts_m = {make_box({1.0, 2.0, 3.0}).positions_m};
  if (solid) options.solid = Solid{.kind = SolidKind::box, .size_m = {1.0, 2.0, 3.0}};
  return options;
}

class GeometryFile : public testing::Test {
 protected:
  void write(const TriangleMesh& mesh, const GeometryOptions& options = {}) {
    disk_.set_contents({});
    auto written = write_geometry_file(disk_, file_database, 7, mesh, options);
    ASSERT_TRUE(written) << written.error().describe();
    checksum_ = written.value();
    bytes_ = disk_.contents().at(file_name);
  }
  Result<StoredMesh> read(const std::vector<std::byte>& bytes) {
    disk_.set_contents({{file_name, bytes}});
    return read_geometry_file(disk_, file_database, 7, checksum_);
  }
  /// The error for the file with another header, whose checksum is valid.
  std::string fault_with(void (*change)(GeometryHeader&)) {
    std::vector<std::byte> changed = bytes_;
    GeometryHeader header;
    std::memcpy(&header, changed.data(), sizeof header);
    change(header);
    header.checksum = checksum_ = header_checksum(header, file_database);
    std::memcpy(changed.data(), &header, sizeof header);
    const auto mesh = read(changed);
    return mesh ? std::string() : mesh.error().message;
  }

  hil::tests::SimulatedDisk disk_{1};
  std::vector<std::byte> bytes_;
  std::uint64_t checksum_ = 0;
};

TEST_F(GeometryFile, HoldsAllThatAMeshMayHave) {
  for (unsigned what = 0; what < 16; ++what) {
    SCOPED_TRACE(what);
    const TriangleMesh mesh = mesh_with((what & 1u) != 0, (what & 2u) != 0);
    const GeometryOptions options = options_with((what & 4u) != 0, (what & 8u) != 0);
    ASSERT_NO_FATAL_FAILURE(write(mesh, options));
    const auto stored = read(bytes_);
    ASSERT_TRUE(stored.ok()) << stored.error().message;
    EXPECT_EQ(stored.value().positions_m, mesh.positions_m);
    EXPECT_EQ(stored.value().triangles, mesh.triangles);
    EXPECT_EQ(stored.value().corner_normals, mesh.corner_normals);
    EXPECT_EQ(stored.value().corner_colors, mesh.corner_colors);
    EXPECT_EQ(stored.value().convex_parts_m, options.convex_parts_m);
    EXPECT_EQ(stored.value().solid.has_value(), options.solid.has_value());
  }
}

/// Files without them are those that older programs of this format write and read: they end behind the
/// triangles, and the word that names the values is zero.
TEST_F(GeometryFile, HasNoBytesForCornersWithoutValues) {
  ASSERT_NO_FATAL_FAILURE(write(mesh_with(false, false), options_with(false, true)));
  EXPECT_EQ(bytes_.size(), 160 + 8 * 12 + 12 * 12u);
  std::uint32_t solid_and_values[2]{};
  std::memcpy(solid_and_values, bytes_.data() + 40, sizeof solid_and_values);
  EXPECT_EQ(solid_and_values[0], 1u);
  EXPECT_EQ(solid_and_values[1], 0u);
  ASSERT_NO_FATAL_FAILURE(write(mesh_with(true, true)));
  EXPECT_EQ(bytes_.size(), 160 + 8 * 12 + 12 * 12 + 2 * 12 * 36u);
}

TEST_F(GeometryFile, IsRefusedIfCutOrChangedAnywhere) {
  ASSERT_NO_FATAL_FAILURE(write(mesh_with(true, true), options_with(true, false)));
  for (std::size_t at = 0; at < bytes_.size(); ++at) {
    const auto cut = static_cast<std::ptrdiff_t>(at);
    EXPECT_FALSE(read({bytes_.begin(), bytes_.begin() + cut}).ok()) << "cut at " << at;
    std::vector<std::byte> changed = bytes_;
    changed[at] ^= std::byte{0x10};
    EXPECT_FALSE(read(changed).ok()) << "changed at " << at;
  }
  std::vector<std::byte> longer = bytes_;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(read(longer).ok());
}

TEST_F(GeometryFile, IsRefusedWithItsFault) {
  const std::string length = std::string(file_name) + ": its length is not that in its header";
  ASSERT_NO_FATAL_FAILURE(write(mesh_with(true, true)));
  EXPECT_EQ(fault_with([](GeometryHeader& header) { header.corner_values = 4; }),
            std::string(file_name) + ": its corners have values of an unknown kind");
  EXPECT_EQ(fault_with([](GeometryHeader& header) { header.corner_values = has_corner_colors; }), length);
  EXPECT_EQ(fault_with([](GeometryHeader& header) { header.corner_values = 0; }), length);
  EXPECT_EQ(fault_with([](GeometryHeader& header) { header.convex_parts = 1; }), length);
  const std::string empty = std::string(file_name) + ": it has no triangle";
  EXPECT_EQ(fault_with([](GeometryHeader& header) { header.triangles = 0; }), empty);
  EXPECT_EQ(fault_with([](GeometryHeader& header) { header.positions = 0; }), empty);
  ASSERT_NO_FATAL_FAILURE(write(mesh_with(true, false)));
  EXPECT_EQ(fault_with([](GeometryHeader& header) { header.corner_values = 3; }), length);
  ASSERT_NO_FATAL_FAILURE(write(mesh_with(true, false)));
  EXPECT_NE(fault_with([](GeometryHeader& header) {
              header.corner_values = has_corner_colors;
            }).find("triangle 0 has at its corner 1 the colour (0, 0, -2), which is outside 0 to 1"),
            std::string::npos);
}

}  // namespace
}  // namespace rtstdb::log::test
