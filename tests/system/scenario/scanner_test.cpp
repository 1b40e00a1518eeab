// A scanner with wide beams in a run: its point clouds, its signals, its history and its report.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "tests/support/pcd_reader.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/two_blocks.hpp"

namespace hil::scenario_test {
namespace {

/// A wall that moves away, half hidden by a post, and a small retro-reflector in front.
const char* const scene = R"(
scenario: scanner
base_rate: 100 Hz
duration: 1 s
clock: virtual
seed: 9
world:
  materials:
    - {name: paint, reflectance: 0.3}
    - {name: retro, reflectance: 0.9, retro_gain: 300}
  entities:
    - {name: mast, shape: {box: [10 cm, 10 cm, 10 cm]}, position: [0 m, 0 m, -1 m], mask: [carrier]}
    - {name: wall, shape: {box: [1 m, 40 m, 40 m]}, position: [40 m, 0 m, 0 m], velocity: [2 m/s, 0 m/s, 0 m/s], material: paint}
    - {name: post, shape: {box: [1 m, 1 m, 40 m]}, position: [20 m, 2 m, 0 m]}
    - {name: reflector, shape: {sphere: 2 cm}, position: [15 m, -1 m, 0.5 m], material: retro}
tasks:
  - module: lidar
    type: laser_scanner
    rate: 100 Hz
    parameters:
      carrier: mast
      mount: [0 m, 0 m, 1 m]
      layers: [static]
      object_layers: [static]
      columns: 60
      rows: 20
      horizontal: 30 deg
      vertical: 10 deg
      scan_rate: 10 Hz
      divergence: 0.6 deg
      returns: 3
      range_noise: 1 cm
      targets: 2
      point_cloud: {rate: 5 Hz}
)";

struct Point {
  std::string entity;
  double range_m = 0.0;
  double intensity = 0.0, fraction = 0.0;
  std::array<double, 3> world_m{};
  int column = 0, row = 0, ordinal = 0;
};

std::vector<Point> points_of(const std::string& csv) {
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  std::vector<Point> points;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    std::vector<std::string> cell;
    for (std::string text; std::getline(cells, text, ',');)
      cell.push_back(text);
    EXPECT_EQ(cell.size(), 14u) << line;
    if (cell.size() != 14) continue;
    points.push_back({.entity = cell[7],
                      .range_m = std::stod(cell[3]),
                      .intensity = std::stod(cell[13]),
                      .fraction = std::stod(cell[12]),
                      .world_m = {std::stod(cell[4]), std::stod(cell[5]), std::stod(cell[6])},
                      .column = std::stoi(cell[1]),
                      .row = std::stoi(cell[2]),
                      .ordinal = std::stoi(cell[11])});
  }
  return points;
}

class ScannerRun : public ::testing::Test {
 protected:
  void run(const std::vector<std::string>& more = {}) {
    write_text(folder_ / "scene.yaml", scene);
    const Ended ended = run_hil(joined({{"run", folder_ / "scene.yaml", "--out", out_}, more}));
    // Nothing is expected of the run, so it does not pass.
    ASSERT_LE(ended.code, 1) << ended.output << ended.errors;
  }
  std::vector<Point> history_points(const std::string& at) {
    const std::string file = folder_ / "points.csv";
    answer({"history", out_, "--json", "scan", "lidar", "--at", at, "--points", file});
    return points_of(read_text(file));
  }
  tests::PcdCloud cloud(const std::string& number) {
    return tests::read_pcd(tests::content_of(out_ + "/pointclouds/lidar-" + number + ".pcd"));
  }

  const Folder folder_;
  const std::string out_ = folder_ / "out";
};

TEST_F(ScannerRun, PointCloudsAreTheScansOfTheHistory) {
  ASSERT_NO_FATAL_FAILURE(run());
  std::size_t second_returns = 0, of_reflector = 0;
  for (int k = 0; k < 5; ++k) {  // of every second sweep
    const tests::PcdCloud seen = cloud("00000" + std::to_string(k + 1));
    const std::vector<Point> points = history_points(std::to_string(200 * k + 50) + " ms");
    ASSERT_EQ(seen.points, points.size()) << k;
    ASSERT_GT(seen.points, 1200u) << "some beams have two returns";
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point& point = points[i];
      ASSERT_EQ(seen["column"][i], point.column);
      ASSERT_EQ(seen["row"][i], point.row);
      ASSERT_EQ(seen["return"][i], point.ordinal);
      // The sensor is at the origin and looks along x.
      for (std::size_t axis = 0; axis < 3; ++axis)
        ASSERT_NEAR(seen[std::string(1, "xyz"[axis])][i], point.world_m[axis], 1e-5);
      ASSERT_EQ(static_cast<float>(seen["intensity"][i]), static_cast<float>(point.intensity));
      ASSERT_EQ(static_cast<float>(seen["fraction"][i]), static_cast<float>(point.fraction));
      const double time_s = 0.2 * k + (point.column * 20 + point.row) / 12000.0;
      ASSERT_NEAR(seen["time"][i], time_s, 1e-8);
      if (point.entity == "wall") {
        const double front_m = 39.5 + 2.0 * time_s;
        ASSERT_NEAR(point.world_m[0], front_m, 0.1 + 5 * 0.01) << "at its own time";
        ASSERT_LT(point.intensity, 0.3 / (39.0 * 39.0));
      }
      second_returns += point.ordinal == 1 ? 1 : 0;
      of_reflector += point.entity == "reflector" ? 1 : 0;
    }
  }
  EXPECT_GT(second_returns, 50u);
  EXPECT_GE(of_reflector, 5u) << "in each sweep, though it is much smaller than a beam";
  EXPECT_FALSE(std::filesystem::exists(out_ + "/pointclouds/lidar-000006.pcd"));
}

/// A fast sensor uses the fields, whose answers differ a little from those of triangles alone; so the history
/// builds the same fields again.
TEST_F(ScannerRun, PointCloudsWithDistanceFieldsAreTheScansOfTheHistory) {
  ASSERT_NO_FATAL_FAILURE(run({"--set", "tasks.lidar.parameters.mode=fast", "--set",
                               "world.entities.post.field={cell: 2 m, sign: none}"}));
  const std::string log = read_text(out_ + "/run.log");
  EXPECT_NE(log.find("distance field of post: "), std::string::npos) << log;
  EXPECT_EQ(log.find("distance field of wall"), std::string::npos) << log;
  const tests::PcdCloud seen = cloud("000003");
  const std::vector<Point> points = history_points("450 ms");
  ASSERT_EQ(seen.points, points.size());
  ASSERT_GT(seen.points, 1200u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(seen["column"][i], points[i].column);
    ASSERT_EQ(seen["return"][i], points[i].ordinal);
    ASSERT_EQ(static_cast<float>(seen["intensity"][i]), static_cast<float>(points[i].intensity));
    ASSERT_NEAR(seen["x"][i], points[i].world_m[0], 1e-5);
  }
}

TEST_F(ScannerRun, TargetsAreOnItsSignalsAndReturnsInItsReport) {
  ASSERT_NO_FATAL_FAILURE(run());
  const Signals signals(out_);
  EXPECT_GE(signals["lidar.target_count"].back(), 1.0);
  EXPECT_NEAR(signals["lidar.target0.azimuth"].back(), std::atan2(-1.0, 15.0), 0.011);
  EXPECT_NEAR(signals["lidar.target0.elevation"].back(), std::atan2(0.5, 15.0), 0.011);
  EXPECT_NEAR(signals["lidar.target0.range"].back(), std::hypot(15.0, 1.0, 0.5), 0.1);
  const double gain =
      0.9 * 300.0 * std::pow(0.02 / std::tan(0.3 * 3.14159265 / 180.0), 2) / std::pow(15.0, 4);
  EXPECT_GT(signals["lidar.target0.intensity"].back(), 0.2 * gain);
  EXPECT_LT(signals["lidar.target0.intensity"].back(), 1.1 * gain);
  const Json report = read_report(out_);
  const auto section = std::ranges::find_if(report["sections"],
                                            [](const Json& one) { return one["name"] == "lidar_returns"; });
  ASSERT_NE(section, report["sections"].end());
  EXPECT_EQ((*section)["tables"].size(), 2u);
  EXPECT_TRUE(std::filesystem::exists(out_ + "/pictures/lidar_bodies-1.svg"));
  EXPECT_TRUE(std::filesystem::exists(out_ + "/pictures/lidar_intensity-1.svg"));
}

TEST_F(ScannerRun, RepeatsWithItsSeedAndNotWithAnother) {
  ASSERT_NO_FATAL_FAILURE(run());
  const std::string first = tests::content_of(out_ + "/pointclouds/lidar-000003.pcd");
  ASSERT_NO_FATAL_FAILURE(run());
  EXPECT_EQ(tests::content_of(out_ + "/pointclouds/lidar-000003.pcd"), first);
  ASSERT_NO_FATAL_FAILURE(run({"--seed", "10"}));
  EXPECT_NE(tests::content_of(out_ + "/pointclouds/lidar-000003.pcd"), first);
}

/// While motion is ignored, a moving scanner sends all beams from where it was when the sweep began.
TEST_F(ScannerRun, HistoryPlacesPointsWhereTheSweepBeganIfMotionIsIgnored) {
  ASSERT_NO_FATAL_FAILURE(run({"--set", "tasks.lidar.parameters.ignore_motion=true", "--set",
                               "tasks.lidar.parameters.range_noise=0 m", "--set",
                               "world.entities.mast.velocity=[0 m/s, 20 m/s, 0 m/s]", "--set",
                               "world.entities.mast.angular_velocity=[0 deg/s, 0 deg/s, 50 deg/s]"}));
  std::size_t on_wall = 0;
  for (const Point& point : history_points("450 ms")) {
    if (point.entity != "wall") continue;
    ++on_wall;
    // First contacts of cones of 0.3 degrees to each side lie on the front at 0.4 s (39.5 m + 2 m/s * 0.4 s),
    // or in front of it by the cone's radius times the slope of the beam.
    ASSERT_GT(point.world_m[0], 40.3 - 0.35);
    ASSERT_LT(point.world_m[0], 40.3 + 0.02);
  }
  EXPECT_GT(on_wall, 300u);
}

TEST_F(ScannerRun, RaysMissTheReflector) {
  ASSERT_NO_FATAL_FAILURE(run({"--set", "tasks.lidar.parameters.divergence=0 deg"}));
  for (const Point& point : history_points("850 ms"))
    EXPECT_NE(point.entity, "reflector");
  const Signals signals(out_);
  EXPECT_EQ(signals["lidar.target_count"].back(), 0.0);
}

}  // namespace
}  // namespace hil::scenario_test
