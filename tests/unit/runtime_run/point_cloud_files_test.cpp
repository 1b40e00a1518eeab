#include "runtime/run/point_cloud_files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "runtime/run/pcd_file.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/pcd_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

using modules::CloudPoint;
using tests::PcdCloud;
using tests::TemporaryFolder;

const rtstdb::Pose sensor{.p_world_m = {1.5, -2.25, 1e-7}, .q_world = {0.5, -0.5, 0.5, 0.5}};

CloudPoint point_of(std::uint32_t k) {
  const auto x = static_cast<float>(k);
  return {.x_m = x + 0.1f,
          .y_m = -x,
          .z_m = 1e-3f * x,
          .intensity_per_m2 = 1.0f / (1.0f + x),
          .fraction = 0.25f,
          .column = k / 7,
          .row = k % 7,
          .ordinal = k % 3,
          .entity = 1000 + k,
          .material = 4000 + k,
          .time_s = 12.3456789012 + 1e-9 * k};
}

/// Hands over a cloud; false: it is lost.
bool send(modules::PointCloudStream& stream, std::uint32_t points) {
  const std::span<CloudPoint> memory = stream.begin();
  if (memory.empty()) return false;
  for (std::uint32_t k = 0; k < points; ++k)
    memory[k] = point_of(k);
  stream.finish(points, sensor);
  return true;
}

void expect_points(const PcdCloud& cloud, std::size_t points) {
  ASSERT_EQ(cloud.points, points);
  EXPECT_EQ(cloud.viewpoint, (std::array{1.5, -2.25, 1e-7, 0.5, -0.5, 0.5, 0.5}));
  for (std::uint32_t k = 0; k < points; ++k) {
    const CloudPoint point = point_of(k);
    EXPECT_EQ(cloud["x"][k], static_cast<double>(point.x_m));
    EXPECT_EQ(cloud["y"][k], static_cast<double>(point.y_m));
    EXPECT_EQ(cloud["z"][k], static_cast<double>(point.z_m));
    EXPECT_EQ(cloud["intensity"][k], static_cast<double>(point.intensity_per_m2));
    EXPECT_EQ(cloud["fraction"][k], 0.25);
    EXPECT_EQ(cloud["column"][k], point.column);
    EXPECT_EQ(cloud["row"][k], point.row);
    EXPECT_EQ(cloud["return"][k], point.ordinal);
    EXPECT_EQ(cloud["entity"][k], point.entity);
    EXPECT_EQ(cloud["material"][k], point.material);
    EXPECT_EQ(cloud["time"][k], point.time_s);
  }
}

TEST(PointCloudFiles, AreReadBackByAnotherProgram) {
  for (const bool virtual_clock : {true, false}) {
    const TemporaryFolder folder;
    PointCloudFiles files(folder.path(), virtual_clock);
    const auto lidar = files.open("lidar", 100);
    const auto rear = files.open("rear", 5);
    ASSERT_TRUE(send(*lidar, 100));
    ASSERT_TRUE(send(*lidar, 0));
    ASSERT_TRUE(send(*rear, 5));
    EXPECT_TRUE(files.close().empty());
    expect_points(tests::read_pcd(folder.read("pointclouds/lidar-000001.pcd")), 100);
    expect_points(tests::read_pcd(folder.read("pointclouds/lidar-000002.pcd")), 0);
    expect_points(tests::read_pcd(folder.read("pointclouds/rear-000001.pcd")), 5);
    EXPECT_FALSE(send(*rear, 1)) << "the files are closed";
  }
}

TEST(PointCloudFiles, AreNotCreatedWithoutAStream) {
  const TemporaryFolder folder;
  PointCloudFiles files(folder.path(), false);
  EXPECT_TRUE(files.close().empty());
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "pointclouds"));
}

TEST(PointCloudFiles, UnderTheVirtualClockNoneIsLost) {
  const TemporaryFolder folder;
  PointCloudFiles files(folder.path(), true);
  const auto lidar = files.open("lidar", 10);
  for (int k = 0; k < 50; ++k)
    ASSERT_TRUE(send(*lidar, 10)) << k;
  EXPECT_TRUE(files.close().empty());
  expect_points(tests::read_pcd(folder.read("pointclouds/lidar-000050.pcd")), 10);
}

// The first file is a pipe, which blocks the writing thread until the test reads it.
TEST(PointCloudFiles, CloudsThatTheDiskIsTooSlowForAreCounted) {
  const TemporaryFolder folder;
  PointCloudFiles files(folder.path(), false);
  const auto lidar = files.open("lidar", 10);
  const std::filesystem::path pipe = folder.path() / "pointclouds/lidar-000001.pcd";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  int sent = 0;
  allocation_guard::reset();
  allocation_guard::enter_tick();
  while (send(*lidar, 10))
    ++sent;
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0u);
  EXPECT_EQ(sent, 3) << "the buffers of a stream";
  EXPECT_FALSE(send(*lidar, 10));
  expect_points(tests::read_pcd(tests::content_of(pipe)), 10);
  ASSERT_TRUE(tests::eventually([&] { return send(*lidar, 10); }));
  const std::vector<std::string> faults = files.close();
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].find("of lidar are not in files: the disk was too slow"), std::string::npos)
      << faults[0];
  expect_points(tests::read_pcd(folder.read("pointclouds/lidar-000003.pcd")), 10);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "pointclouds/lidar-000004.pcd")) << "the lost one";
}

TEST(PointCloudFiles, FileThatCanNotBeWrittenIsReported) {
  const TemporaryFolder folder;
  PointCloudFiles files(folder.path(), true);
  const auto lidar = files.open("lidar", 10);
  std::filesystem::create_directory(folder.path() / "pointclouds/lidar-000001.pcd");
  ASSERT_TRUE(send(*lidar, 1));
  ASSERT_TRUE(send(*lidar, 1));
  const std::vector<std::string> faults = files.close();
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].find("1 point cloud of lidar could not be written; the first: "), std::string::npos);
  EXPECT_NE(faults[0].find("lidar-000001.pcd can not be written"), std::string::npos) << faults[0];
  expect_points(tests::read_pcd(folder.read("pointclouds/lidar-000002.pcd")), 1);
}

}  // namespace
}  // namespace hil::run
