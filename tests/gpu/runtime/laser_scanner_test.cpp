// The laser scanner against closed forms: intensities of plates, covered fractions, several returns, the
// threshold, noise, targets, and beams at their own times.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "runtime/modules/laser_scanner/pcd_encoder.hpp"
#include "runtime/modules/laser_scanner/scanner_options.hpp"
#include "runtime/modules/laser_scanner/scanner_ports.hpp"
#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t scan_period_ns = 10'000'000;

/// Three beams side by side; the middle one runs exactly along x. One sweep is one step.
const std::string three_beams =
    "carrier: sensor, layers: [scene], object_layers: [scene], columns: 3, rows: 1, scan_rate: 100 Hz, "
    "horizontal: 0.003 rad, point_cloud: {rate: 100 Hz}, range: 500 m";

class LaserScannerTest : public test::ModuleFixture {
 protected:
  LaserScannerTest() : ModuleFixture({"scene"}) {}

  void SetUp() override {
    ModuleFixture::SetUp();
    rtstdb::EntityRow sensor;
    sensor.mask = 0;
    world_->create("sensor", sensor);
  }

  /// A square of this edge length whose front looks to -x; it is turned by `tilt_rad` about y.
  rtstdb::EntityId add_plate(const std::string& name, const glm::dvec3& center_m, double edge_m,
                             const rtstdb::Material& material = {}, double tilt_rad = 0.0,
                             const glm::dvec3& v_mps = {}) {
    rtstdb::EntityRow row;
    row.geometry = world_->add_geometry(rtstdb::make_rectangle(edge_m, edge_m), name);
    row.mask = 1;
    row.material = world_->add_material(name, material);
    row.motion.p_world_m = center_m;
    const double half = 0.5 * (tilt_rad - 0.5 * 3.14159265358979323846);
    row.motion.q_world = {std::cos(half), 0.0, std::sin(half), 0.0};
    row.motion.v_world_mps = v_mps;
    return world_->create(name, row);
  }

  std::unique_ptr<AnyModule> make_scanner(const std::string& parameters, std::uint64_t seed = 1) {
    auto scanner =
        make(*find_module_type("laser_scanner"), "{" + parameters + "}",
             {.instance = "lidar", .period_ns = scan_period_ns, .deadline_ns = scan_period_ns, .seed = seed});
    EXPECT_NE(scanner, nullptr) << diagnostics_.to_text();
    return scanner;
  }

  std::span<CloudPoint> last_cloud() { return points_in(files_.buffer(files_.count - 1)); }
  /// The points of the middle beam in the cloud of one sweep.
  std::vector<CloudPoint> sweep(const std::string& more = "") {
    const auto scanner = make_scanner(three_beams + more);
    outputs_ = step(*scanner, 0, 0, scan_period_ns);
    EXPECT_EQ(files_.count, 1u);
    std::vector<CloudPoint> points;
    if (files_.count > 0) {
      std::ranges::copy_if(last_cloud(), std::back_inserter(points),
                           [](const CloudPoint& point) { return point.column == 1; });
    }
    files_.clear();
    return points;
  }

  std::vector<double> outputs_;
};

TEST_F(LaserScannerTest, PlateAt45DegreesReturnsCosineOverSquaredRange) {
  constexpr double tilt_rad = 0.25 * 3.14159265358979323846;
  const rtstdb::EntityId plate = add_plate("plate", {10.0, 0.0, 0.0}, 4.0, {.reflectance = 0.5}, tilt_rad);
  const auto points = sweep();
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0].entity, plate.index);
  EXPECT_NEAR(points[0].x_m, 10.0f, 1e-5f);
  EXPECT_NEAR(points[0].y_m, 0.0f, 1e-5f);
  EXPECT_NEAR(points[0].z_m, 0.0f, 1e-5f);
  EXPECT_EQ(points[0].fraction, 1.0f);
  EXPECT_NEAR(points[0].intensity_per_m2, 0.5 * std::cos(tilt_rad) / 100.0, 1e-8);
  EXPECT_EQ(outputs_[outputs_.size() - 2], 3.0) << "hits: all three beams";
}

TEST_F(LaserScannerTest, CosineOfAWideBeamIsThatOfThePlane) {
  constexpr double tilt_rad = 0.25 * 3.14159265358979323846;
  add_plate("plate", {10.0, 0.0, 0.0}, 4.0, {}, tilt_rad);
  const auto points = sweep(", divergence: 0.02 rad");
  ASSERT_EQ(points.size(), 1u);
  // The first contact is at the side of the cone where the plane is nearest: z (1 + tan(a/2)) = 10 m.
  const double contact_m = 10.0 / (1.0 + std::tan(0.01));
  EXPECT_NEAR(points[0].x_m, contact_m, 1e-4);
  EXPECT_NEAR(points[0].fraction, 1.0f, 1e-4f);
  EXPECT_NEAR(points[0].intensity_per_m2, std::cos(tilt_rad) / (contact_m * contact_m), 1e-6);
}

TEST_F(LaserScannerTest, HalfCoveredBeamHasHalfTheIntensity) {
  add_plate("plate", {10.0, 5.0, 0.0}, 10.0);  // covers y > 0
  const auto points = sweep(", divergence: 0.02 rad, returns: 4");
  ASSERT_EQ(points.size(), 1u);
  EXPECT_NEAR(points[0].fraction, 0.5f, 1.0f / 64.0f);
  EXPECT_NEAR(points[0].intensity_per_m2, 0.5 / 100.0, 0.01 / 64.0);
}

TEST_F(LaserScannerTest, TwoPlatesInOneBeamGiveTwoReturns) {
  const rtstdb::EntityId near = add_plate("near", {10.0, 5.0, 0.0}, 10.0);
  const rtstdb::EntityId far = add_plate("far", {20.0, 0.0, 0.0}, 10.0, {.reflectance = 0.8});
  const auto points = sweep(", divergence: 0.02 rad, returns: 4");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].entity, near.index);
  EXPECT_EQ(points[1].entity, far.index);
  EXPECT_EQ(points[0].ordinal, 0u);
  EXPECT_EQ(points[1].ordinal, 1u);
  EXPECT_NEAR(points[0].x_m, 10.0f, 1e-4f);
  EXPECT_NEAR(points[1].x_m, 20.0f, 1e-4f);
  // 64 directions estimate which part of a hidden entity is visible; the border may pass two of them.
  EXPECT_NEAR(points[1].fraction, 0.5f, 2.0f / 64.0f);
  EXPECT_NEAR(points[1].intensity_per_m2, 0.8 * 0.5 / 400.0, 0.8 / 400.0 * 2.0 / 64.0);
  EXPECT_EQ(sweep(", divergence: 0.02 rad").size(), 1u) << "one return of a beam: the nearest";
  EXPECT_EQ(sweep(", returns: 4").size(), 1u) << "a ray has one";
}

TEST_F(LaserScannerTest, SmallRetroReflectorIsBrighterThanThePlateBehindIt) {
  add_plate("plate", {100.0, 0.0, 0.0}, 20.0, {.reflectance = 0.5});
  const rtstdb::EntityId retro =
      add_plate("retro", {99.0, 0.0, 0.0}, 0.05, {.reflectance = 0.9, .retro_gain = 300.0}, 0.5);
  const auto points = sweep(", divergence: 0.002 rad, returns: 2, targets: 2");
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].entity, retro.index);
  const double share = 0.05 * 0.05 * std::cos(0.5) / (3.14159265 * 0.099 * 0.099);
  EXPECT_NEAR(points[0].fraction, share, 0.01 * share);
  const double expected = 0.9 * 300.0 * share / (99.0 * 99.0);
  EXPECT_NEAR(points[0].intensity_per_m2, expected, 0.02 * expected);
  EXPECT_GT(points[0].intensity_per_m2, 10.0f * points[1].intensity_per_m2);
}

TEST_F(LaserScannerTest, ReturnsBelowTheThresholdAreNotDetected) {
  add_plate("near", {10.0, 0.0, 0.0}, 4.0, {.reflectance = 0.5});
  EXPECT_EQ(sweep(", threshold: 0.004999").size(), 1u);
  EXPECT_EQ(sweep(", threshold: 0.005001").size(), 0u);
  EXPECT_EQ(outputs_[outputs_.size() - 2], 0.0) << "hits";
}

TEST_F(LaserScannerTest, NoiseHasItsDeviationAndRepeatsWithTheSeed) {
  add_plate("plate", {50.0, 0.0, 0.0}, 20.0);
  const auto ranges = [&](std::uint64_t seed) {
    const auto scanner = make_scanner(
        "carrier: sensor, layers: [scene], object_layers: [scene], columns: 100, rows: 50, scan_rate: 100 "
        "Hz, "
        "horizontal: 0.001 rad, vertical: 0.001 rad, point_cloud: {rate: 100 Hz}, range_noise: 3 cm",
        seed);
    step(*scanner, 0, 0, scan_period_ns);
    std::vector<float> all;
    for (const CloudPoint& point : last_cloud())
      all.push_back(std::hypot(point.x_m, point.y_m, point.z_m));
    return all;
  };
  const std::vector<float> first = ranges(5);
  ASSERT_EQ(first.size(), 5000u);
  double mean = 0.0, square = 0.0;
  for (const float range_m : first)
    mean += static_cast<double>(range_m) / 5000.0;
  for (const float range_m : first)
    square += std::pow(static_cast<double>(range_m) - mean, 2) / 5000.0;
  EXPECT_NEAR(mean, 50.0, 0.003);
  EXPECT_NEAR(std::sqrt(square), 0.03, 0.0015);
  EXPECT_EQ(ranges(5), first);
  EXPECT_NE(ranges(6), first);
}

TEST_F(LaserScannerTest, RangesWithoutDivergenceAreThoseOfARayQuery) {
  add_plate("plate", {30.0, 0.3, 0.1}, 3.0, {}, 0.3, {4.0, 1.0, 0.0});
  const auto scanner = make_scanner(
      "carrier: sensor, layers: [scene], object_layers: [scene], columns: 40, rows: 20, scan_rate: 100 Hz, "
      "horizontal: 10 deg, vertical: 6 deg, point_cloud: {rate: 100 Hz}");
  step(*scanner, 0, 0, scan_period_ns);
  const ScanPattern pattern({.columns = 40,
                             .rows = 20,
                             .horizontal_rad = 10.0 * 3.14159265358979323846 / 180.0,
                             .vertical_rad = 6.0 * 3.14159265358979323846 / 180.0,
                             .period_ns = scan_period_ns});
  auto rays = database_->prepare(rtstdb::RayQueryOptions{.name = "rays", .capacity = 800});
  ASSERT_TRUE(rays);
  for (std::uint32_t beam = 0; beam < 800; ++beam) {
    rays.value()->rays()[beam] = {
        .direction = pattern.direction(pattern.column_of(beam), pattern.row_of(beam)),
        .lambda_max = 120.0f,
        .t = rtstdb::world_time_ns(pattern.time_ns(beam)),
        .carrier = *world_->find("sensor")};
  }
  const auto transaction = database_->make_transaction({.max_queries = 1});
  transaction->begin({});
  transaction->add_query(*rays.value(), 800);
  ASSERT_TRUE(database_->execute(*transaction).done());
  const std::span<const CloudPoint> points = last_cloud();
  std::size_t next = 0;
  for (std::uint32_t beam = 0; beam < 800; ++beam) {
    const rtstdb::RayHit& hit = rays.value()->hits()[beam];
    if (hit.status != rtstdb::HitStatus::hit) continue;
    ASSERT_LT(next, points.size());
    const glm::dvec3 expected = glm::dvec3(pattern.direction(pattern.column_of(beam), pattern.row_of(beam))) *
                                static_cast<double>(hit.lambda);
    EXPECT_EQ(points[next].x_m, static_cast<float>(expected.x)) << beam;
    EXPECT_EQ(points[next].row, pattern.row_of(beam));
    ++next;
  }
  EXPECT_EQ(next, points.size());
  EXPECT_GT(next, 50u);
  EXPECT_LT(next, 750u);
}

TEST_F(LaserScannerTest, WideBeamsMeetMovingBodiesAtTheirOwnTimes) {
  add_plate("plate", {50.0, 0.0, 0.0}, 20.0, {}, 0.0, {-20.0, 0.0, 0.0});
  const auto scanner = make_scanner(
      "carrier: sensor, layers: [scene], object_layers: [scene], columns: 200, rows: 1, scan_rate: 5 Hz, "
      "horizontal: 0.002 rad, divergence: 0.001 rad, returns: 2, point_cloud: {rate: 5 Hz}");
  for (int run = 0; run < 20; ++run)
    step(*scanner, static_cast<std::uint64_t>(run), run * scan_period_ns, scan_period_ns);
  ASSERT_EQ(files_.count, 1u);
  const std::span<const CloudPoint> points = last_cloud();
  ASSERT_EQ(points.size(), 200u);
  for (const CloudPoint& point : points) {
    EXPECT_NEAR(point.time_s, 0.001 * point.column, 1e-9);
    // First contact of a plane that the axis meets at up to 1 mrad: at the rim of the cone.
    EXPECT_NEAR(point.x_m, 50.0 - 20.0 * point.time_s, 1e-4) << point.column;
  }
}

TEST_F(LaserScannerTest, BeamsMeetBodiesWhereTheyWereAtTheBeginningOfASweepIfMotionIsIgnored) {
  // Three beams at 0 ms, 3.33 ms and 6.67 ms meet a wall that comes at 60 m/s.
  add_plate("wall", {10.0, 0.0, 0.0}, 40.0, {}, 0.0, {-60.0, 0.0, 0.0});
  for (const std::string divergence : {"0 rad", "0.0001 rad"}) {
    for (const bool ignored : {false, true}) {
      const auto points = sweep(", divergence: " + divergence + (ignored ? ", ignore_motion: true" : ""));
      ASSERT_EQ(points.size(), 1u) << divergence;
      EXPECT_NEAR(points[0].x_m, ignored ? 10.0 : 10.0 - 60.0 * 0.01 / 3.0, 2e-3) << divergence;
    }
  }
}

TEST_F(LaserScannerTest, TargetsAreTheBrightestRetroReflectorsOfASweep) {
  const rtstdb::Material dim{.reflectance = 0.5, .retro_gain = 100.0},
      bright{.reflectance = 0.9, .retro_gain = 900.0};
  add_plate("wall", {40.0, 0.0, 0.0}, 60.0);
  add_plate("left", {20.0, 2.0, 0.0}, 0.5, dim);
  add_plate("right", {20.0, -2.0, 1.0}, 0.5, bright);
  const std::string parameters =
      "carrier: sensor, layers: [scene], object_layers: [scene], columns: 41, rows: 21, scan_rate: 100 Hz, "
      "horizontal: 20 deg, vertical: 10 deg, divergence: 0.6 deg, returns: 2, targets: 3";
  const auto scanner = make_scanner(parameters);
  const auto outputs = step(*scanner, 0, 0, scan_period_ns);
  ScannerOptions options;
  options.max_objects = 4;
  const ScannerOutputs places(options);
  ASSERT_EQ(outputs.size(), places.target(3));
  EXPECT_EQ(scanner->ports().outputs[places.target_count()].name, "target_count");
  EXPECT_EQ(scanner->ports().outputs[places.target(2) + 3].name, "target2.intensity");
  EXPECT_GT(outputs[places.target_count()], 3.0) << "a reflector is in several beams";
  const auto target = [&](std::uint32_t k) { return std::span(outputs).subspan(places.target(k), 4); };
  EXPECT_NEAR(target(0)[0], std::atan2(-2.0, 20.0), 0.01) << "azimuth of the bright one";
  EXPECT_NEAR(target(0)[1], std::atan2(1.0, std::hypot(20.0, 2.0)), 0.01);
  EXPECT_NEAR(target(0)[2], 20.0, 0.25);
  EXPECT_GE(target(0)[3], target(1)[3]);
  EXPECT_GE(target(1)[3], target(2)[3]);
  EXPECT_GT(target(2)[3], 0.0);
}

TEST_F(LaserScannerTest, ReportHasATableOfReturnsByBody) {
  add_plate("near", {10.0, 5.0, 0.0}, 10.0);
  add_plate("far", {20.0, 0.0, 0.0}, 10.0);
  const auto scanner = make_scanner(three_beams + ", divergence: 0.02 rad, returns: 4");
  step(*scanner, 0, 0, scan_period_ns);
  contribution::Contribution report;
  scanner->contribute(report);
  const auto section =
      std::ranges::find(report.sections, std::string("lidar_returns"), &contribution::Section::name);
  ASSERT_NE(section, report.sections.end());
  ASSERT_EQ(section->tables.size(), 2u) << "by body, and by place in the beam";
  const contribution::Table& bodies = section->tables[0];
  ASSERT_EQ(bodies.rows.size(), 2u);
  EXPECT_EQ(bodies.rows[0][0].text, "near");
  EXPECT_EQ(bodies.rows[0][1].number, 3.0);
  EXPECT_EQ(bodies.rows[1][0].text, "far");
  EXPECT_NEAR(bodies.rows[1][3].number, 20.0, 1e-3);
  EXPECT_EQ(section->tables[1].rows.size(), 2u);

  const auto picture_in = [&](const std::string& name) {
    const auto found = std::ranges::find(report.sections, name, &contribution::Section::name);
    return found != report.sections.end() ? found->pictures.at(0) : contribution::Picture{};
  };
  const contribution::Picture bodies_seen = picture_in("lidar_bodies");
  EXPECT_EQ(bodies_seen.entities, (std::vector<std::string>{"near", "far"}));
  EXPECT_EQ(bodies_seen.subject, contribution::no_subject);
  ASSERT_EQ(bodies_seen.points.size(), 6u);
  EXPECT_EQ(bodies_seen.points[0].entity, 0u);
  EXPECT_EQ(bodies_seen.points[1].entity, 1u);
  const contribution::Picture intensities = picture_in("lidar_intensity");
  ASSERT_EQ(intensities.points.size(), 6u);
  EXPECT_EQ(intensities.entities.at(0), "above 1e-3 1/m²");
  EXPECT_EQ(intensities.points[0].entity, 0u) << "0.5 / 10 m / 10 m";
  EXPECT_EQ(intensities.points[1].entity, 0u) << "0.5 / 20 m / 20 m = 1.25e-3";
}

}  // namespace
}  // namespace hil::modules
