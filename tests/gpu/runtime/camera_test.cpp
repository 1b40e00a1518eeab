// The camera against closed forms: boxes, pixels and visible shares of plates, with a global and a rolling
// shutter, on a carrier that moves; luminances of plates that emit light; what the steps allocate.

#include <glm/gtc/packing.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "runtime/modules/camera/image_encoder.hpp"
#include "tests/gpu/runtime/module_fixture.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t period_ns = 100'000'000;
constexpr double pi = 3.14159265358979323846;

/// A camera of 64 x 48 pixels and 90 degrees: a pixel at the depth d is d / 32 wide.
const std::string small_camera = "resolution: [64, 48], field_of_view: 90 deg, samples: 1, bounces: 0";

class CameraTest : public test::ModuleFixture {
 protected:
  CameraTest() : ModuleFixture({"scene", "other"}) {}

  void SetUp() override {
    ModuleFixture::SetUp();
    allocation_guard::reset();
  }
  void TearDown() override { EXPECT_EQ(allocation_guard::seen().total(), 0U) << "in the steps"; }

  /// A square across x.
  rtstdb::EntityId add_plate(const std::string& name, const glm::dvec3& center_m, double edge_m,
                             const glm::dvec3& v_mps = {}, double emission_cdpm2 = 0.0,
                             std::uint32_t mask = 1) {
    rtstdb::EntityRow row;
    row.geometry = world_->add_geometry(rtstdb::make_rectangle(edge_m, edge_m), name);
    row.mask = mask;
    row.material = world_->add_material(
        name, {.base_color = glm::dvec3(0.0), .emission_cdpm2 = glm::dvec3(emission_cdpm2)});
    row.motion.p_world_m = center_m;
    row.motion.q_world = {std::cos(-0.25 * pi), 0.0, std::sin(-0.25 * pi), 0.0};
    row.motion.v_world_mps = v_mps;
    return world_->create(name, row);
  }

  void make_camera(const std::string& more, const std::string& name = "front") {
    camera_ = make(*find_module_type("camera"), "{" + base_ + ", " + more + "}",
                   {.instance = name, .period_ns = period_ns, .deadline_ns = period_ns, .seed = 4});
    ASSERT_NE(camera_, nullptr) << diagnostics_.to_text();
  }
  /// The image that was handed over as number `number`.
  ImageBuffer image_of(std::size_t number) {
    return dynamic_cast<const ImageEncoder&>(*files_.options.encoder).parts_of(files_.buffer(number));
  }
  /// The outputs of a step, by name.
  std::map<std::string, double> take(std::uint64_t run = 0) {
    const auto values = step(*camera_, run, static_cast<std::int64_t>(run) * period_ns, period_ns);
    std::map<std::string, double> outputs;
    for (std::size_t i = 0; i < values.size(); ++i)
      outputs[camera_->ports().outputs[i].name] = values[i];
    return outputs;
  }
  static void expect_object(std::map<std::string, double>& outputs, int slot, rtstdb::EntityId entity,
                            const std::array<double, 4>& box, double depth_m, double pixels, double share) {
    const std::string object = "object" + std::to_string(slot);
    EXPECT_EQ(outputs[object + ".valid"], 1.0) << object;
    EXPECT_EQ(outputs[object + ".entity"], entity.index) << object;
    const std::array<double, 4> found{outputs[object + ".x_min"], outputs[object + ".y_min"],
                                      outputs[object + ".x_max"], outputs[object + ".y_max"]};
    EXPECT_EQ(found, box) << object;
    EXPECT_NEAR(outputs[object + ".depth"], depth_m, 1e-5 * depth_m) << object;
    EXPECT_EQ(outputs[object + ".pixels"], pixels) << object;
    EXPECT_DOUBLE_EQ(outputs[object + ".share"], share) << object;
    EXPECT_EQ(outputs[object + ".share_exact"], 1.0) << object;
  }

  std::string base_ = small_camera;
  std::unique_ptr<AnyModule> camera_;
};

TEST_F(CameraTest, ListsTheNearestBodiesWithBoxesAndVisibleShares) {
  const auto front = add_plate("front", {8.0, 0.0, 0.0}, 2.0);      // 8 x 8 pixels around the middle
  const auto back = add_plate("back", {16.0, -4.0, 0.0}, 8.0);      // 16 x 16 pixels to the right of it
  const auto beside = add_plate("beside", {16.0, 12.0, 0.0}, 4.0);  // 8 x 8 pixels, columns 4 to 11
  make_camera("objects: 4, images: none");
  auto outputs = take();
  EXPECT_EQ(outputs["object_count"], 3.0);
  expect_object(outputs, 0, front, {28, 20, 36, 28}, 8.0, 64, 1.0);
  expect_object(outputs, 1, back, {32, 16, 48, 32}, 16.0, 224, 224.0 / 256.0);
  expect_object(outputs, 2, beside, {4, 20, 12, 28}, 16.0, 64, 1.0);
  EXPECT_EQ(outputs["object3.valid"], 0.0);
  EXPECT_EQ(outputs["object3.share"], 0.0);
  EXPECT_EQ(outputs["image_count"], 1.0);
  EXPECT_EQ(outputs["missing_tiles"], 0.0);
  EXPECT_DOUBLE_EQ(outputs["age"], 0.0) << "without a thread the outputs are visible at the release";
  EXPECT_EQ(files_.count, 0U) << "images: none";
  EXPECT_EQ(take(1)["image_count"], 2.0);
}

TEST_F(CameraTest, RollingShutterSeesEachRowAtItsTime) {
  // The front plate moves to the right by one pixel in the time of a row. In row 24 it is in the middle.
  const auto front = add_plate("front", {8.0, 6.0, 0.0}, 2.0, {0.0, -250.0, 0.0});
  const auto back = add_plate("back", {16.0, -4.0, 0.0}, 8.0);
  make_camera("objects: 2, images: none, row_time: 1 ms");
  auto outputs = take();
  // Row 20 is at columns 24 to 31, row 27 at 31 to 38: 0 to 7 pixels of the back plate are hidden.
  expect_object(outputs, 0, front, {24, 20, 39, 28}, 8.0, 64, 1.0);
  expect_object(outputs, 1, back, {32, 16, 48, 32}, 16.0, 256 - 28, (256.0 - 28.0) / 256.0);
}

TEST_F(CameraTest, MovesAndTurnsWithItsCarrier) {
  rtstdb::EntityRow carrier;
  carrier.mask = 0;
  carrier.motion.p_world_m = {0.0, -20.0, 3.0};
  carrier.motion.q_world = {std::cos(0.25 * pi), 0.0, 0.0, std::sin(0.25 * pi)};  // looks along y
  carrier.motion.v_world_mps = {10.0, 0.0, 0.0};
  world_->create("car", carrier);
  const auto plate = add_plate("plate", {21.0, -18.0, 3.0}, 2.0);
  // In the carrier's frame the camera is 2 m ahead and looks to the right, along x of the world.
  make_camera("carrier: car, mount: [2 m, 0 m, 0 m], rotation: {yaw: -90 deg}, objects: 1, images: none");
  auto outputs = take(0);
  EXPECT_NEAR(outputs["object0.depth"], 21.0, 1e-4);
  outputs = take(13);  // the camera is 13 m further, 8 m in front of the plate
  expect_object(outputs, 0, plate, {28, 20, 36, 28}, 8.0, 64, 1.0);
}

TEST_F(CameraTest, LayersDecideWhatIsSeenAndWhatIsAnObject) {
  const auto seen = add_plate("seen", {16.0, 0.0, 0.0}, 8.0, {}, 0.0, 1);
  add_plate("hidden", {4.0, 0.0, 0.0}, 4.0, {}, 0.0, 0);
  const auto other = add_plate("other", {8.0, 0.0, 0.0}, 2.0, {}, 0.0, 2);
  make_camera("objects: 3, images: none, object_layers: [scene]");
  auto outputs = take();
  EXPECT_EQ(outputs["object_count"], 1.0);
  expect_object(outputs, 0, seen, {24, 16, 40, 32}, 16.0, 256 - 64, 0.75);
  make_camera("objects: 3, images: none, layers: [other]", "second");
  outputs = take();
  EXPECT_EQ(outputs["object_count"], 1.0);
  expect_object(outputs, 0, other, {28, 20, 36, 28}, 8.0, 64, 1.0);
}

/// A plate at the back of its box, whose front is a triangle that covers no pixel.
rtstdb::TriangleMesh plate_in_a_deep_box() {
  rtstdb::TriangleMesh mesh;
  mesh.positions_m = {{20.0f, -5.0f, -5.0f}, {20.0f, 5.0f, -5.0f}, {20.0f, 5.0f, 5.0f}, {20.0f, -5.0f, 5.0f},
                      {10.0f, 4.9f, 4.9f},   {10.0f, 5.0f, 4.9f},  {10.0f, 5.0f, 5.0f}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}};
  return mesh;
}

TEST_F(CameraTest, ShareIsNotExactBehindMoreSurfacesThanARayLists) {
  rtstdb::EntityRow row;
  row.geometry = world_->add_geometry(plate_in_a_deep_box(), "deep");
  row.mask = 1;
  world_->create("deep", row);
  // Each covers the right half of the deep plate. A ray lists 16 of them.
  for (int i = 0; i < 15; ++i) {
    const double x_m = 12.0 + 0.25 * i;
    add_plate("sheet" + std::to_string(i), {x_m, -10.0, 0.0}, 20.0);
  }
  make_camera("objects: 16, images: none");
  const auto deep_slot = [](std::map<std::string, double>& outputs) {
    const double last = outputs["object_count"] - 1.0;
    return "object" + std::to_string(static_cast<int>(last));
  };
  auto outputs = take();
  ASSERT_EQ(outputs["object_count"], 2.0) << "the first sheet hides the others";
  const std::string deep = deep_slot(outputs);
  EXPECT_EQ(outputs[deep + ".x_min"], 24.0);
  EXPECT_EQ(outputs[deep + ".x_max"], 32.0) << "half of 16 columns";
  EXPECT_EQ(outputs[deep + ".share"], 0.5);
  EXPECT_EQ(outputs[deep + ".share_exact"], 1.0);
  add_plate("sheet15", {16.0, -10.0, 0.0}, 20.0);
  outputs = take(1);
  EXPECT_EQ(outputs[deep + ".share"], 1.0) << "without the pixels that are not decided";
  EXPECT_EQ(outputs[deep + ".share_exact"], 0.0);
}

TEST_F(CameraTest, HandsOverColoursAndDepths) {
  // Half of the luminance that is white at the exposure value 6.
  add_plate("lamp", {8.0, 0.0, 0.0}, 2.0, {}, 0.5 * 1.2 * 64.0);
  make_camera("exposure_value: 6, depth_files: {}");
  take(3);
  ASSERT_EQ(files_.count, 1U);
  const ImageBuffer image = image_of(0);
  EXPECT_EQ(files_.time_ns(0), 3 * period_ns);
  ASSERT_EQ(image.srgb.size(), 64U * 48U);
  for (std::uint32_t y = 0; y < 48; ++y) {
    for (std::uint32_t x = 0; x < 64; ++x) {
      const bool on_plate = x >= 28 && x < 36 && y >= 20 && y < 28;
      // The samples of a pixel are spread over it, so those at the border of the plate are left out.
      const bool at_border =
          x >= 27 && x < 37 && y >= 19 && y < 29 && !(x >= 29 && x < 35 && y >= 21 && y < 27);
      const rtstdb::SrgbColor& color = image.srgb[y * 64 + x];
      if (!at_border) {
        EXPECT_EQ(color, (on_plate ? rtstdb::SrgbColor{188, 188, 188, 255} : rtstdb::SrgbColor{0, 0, 0, 255}))
            << x << " " << y;
      }
      const float depth_m = image.depth_m[y * 64 + x];
      EXPECT_EQ(std::isfinite(depth_m), on_plate);
      if (on_plate) {
        EXPECT_NEAR(depth_m, 8.0f, 1e-5f);
      }
    }
  }
}

/// A lamp at the camera lights a large plate; a small one is off its axis and hides a part of it from the
/// lamp, but not from the camera beside it.
TEST_F(CameraTest, InRealTimeModeLampsThrowShadows) {
  rtstdb::EntityRow lamp;
  lamp.light = world_->add_light("lamp", {.kind = rtstdb::LightKind::point, .intensity_cd = 6400.0});
  lamp.motion.p_world_m = {0.0, 2.0, 0.0};
  world_->create("lamp", lamp);
  const auto add_painted_plate = [&](const std::string& name, const glm::dvec3& center_m, double edge_m) {
    rtstdb::EntityRow row;
    row.geometry = world_->add_geometry(rtstdb::make_rectangle(edge_m, edge_m), name);
    row.material = world_->add_material(name, {.base_color = glm::dvec3(0.5), .refractive_index = 1.0});
    row.motion.p_world_m = center_m;
    row.motion.q_world = {std::cos(-0.25 * pi), 0.0, std::sin(-0.25 * pi), 0.0};
    world_->create(name, row);
  };
  add_painted_plate("large", {8.0, 0.0, 0.0}, 12.0);
  add_painted_plate("small", {4.0, 2.0, 0.0}, 1.0);  // its shadow: 7 x 7 pixels around (24, 24)
  for (const std::string shadows : {"traced", "mapped"}) {
    base_ = "resolution: [64, 48], field_of_view: 90 deg, bounces: 1, mode: real_time, shadows: " + shadows;
    make_camera("noise: {full_well: 8000}", "front_" + shadows);
    take();
    const auto color = image_of(files_.count - 1).color;
    const auto luminance = [&](std::size_t column, std::size_t row) {
      return static_cast<double>(glm::unpackHalf1x16(color[row * 64 + column][0]));
    };
    EXPECT_EQ(luminance(25, 24), 0.0) << shadows;
    // The pixel is 0.125 m below and to the right of the plate's middle.
    const double distance_m = std::sqrt(64.0 + 2.125 * 2.125 + 0.125 * 0.125);
    const double expected = 0.5 / pi * 6400.0 * 8.0 / std::pow(distance_m, 3.0);
    EXPECT_NEAR(luminance(32, 24), expected, 0.002 * expected) << shadows;
  }
}

TEST_F(CameraTest, WithNoiseItHandsOverLuminances) {
  add_plate("lamp", {8.0, 0.0, 0.0}, 2.0, {}, 40.0);
  make_camera("exposure_value: 6, noise: {full_well: 8000, read_noise: 10}, seed: 12");
  take();
  ASSERT_EQ(files_.count, 1U);
  ASSERT_EQ(image_of(0).color.size(), 64U * 48U);
  EXPECT_NEAR(glm::unpackHalf1x16(image_of(0).color[24 * 64 + 32][0]), 40.0f, 0.05f);
}

TEST_F(CameraTest, AgeCountsUntilTheDeadlineOfATaskThread) {
  add_plate("lamp", {8.0, 0.0, 0.0}, 2.0, {}, 40.0);
  camera_ =
      make(*find_module_type("camera"), "{" + base_ + "}",
           {.instance = "front", .period_ns = period_ns, .deadline_ns = 20'000'000, .own_thread = true});
  ASSERT_NE(camera_, nullptr) << diagnostics_.to_text();
  EXPECT_DOUBLE_EQ(take()["age"], 20.0);
}

TEST_F(CameraTest, SaysThatAListIsVisibleBeforeTheExposureEnds) {
  add_plate("lamp", {8.0, 0.0, 0.0}, 2.0, {}, 40.0);
  const auto events_with = [&](const std::string& more, std::int64_t deadline_ns, bool own_thread) {
    camera_ = make(
        *find_module_type("camera"), "{" + base_ + ", exposure_time: 5 ms" + more + "}",
        {.instance = "front", .period_ns = period_ns, .deadline_ns = deadline_ns, .own_thread = own_thread});
    take();
    contribution::Contribution report;
    camera_->contribute(report);
    std::vector<std::string> texts;
    for (const auto& event : report.events)
      texts.push_back(event.text);
    return texts;
  };
  const std::string objects = ", objects: 1";
  EXPECT_EQ(events_with(objects, period_ns, false),
            std::vector<std::string>{
                "camera front: the object list is visible 0 ms after the release, before the exposure of "
                "the image ends after 5 ms; for a device under test the task needs a 'thread' and a later "
                "'deadline'"});
  EXPECT_EQ(events_with(objects, 4'000'000, true).size(), 1U);
  EXPECT_TRUE(events_with(objects, 5'000'000, true).empty());
  EXPECT_TRUE(events_with("", period_ns, false).empty()) << "without a list";
}

TEST_F(CameraTest, TakesImagesAtTheNearestReleases) {
  add_plate("lamp", {8.0, 0.0, 0.0}, 2.0, {}, 40.0);
  make_camera("frames_per_second: 4 Hz");  // every 250 ms, the task each 100 ms
  std::vector<double> ages_ms;
  for (std::uint64_t run = 0; run < 11; ++run)
    ages_ms.push_back(take(run)["age"]);
  ASSERT_EQ(files_.count, 5U);
  const std::int64_t releases[] = {0, 3, 5, 8, 10};
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_EQ(files_.time_ns(i), releases[i] * period_ns);
  EXPECT_EQ(ages_ms, (std::vector<double>{0, 100, 200, 0, 100, 0, 100, 200, 0, 100, 0}));
  contribution::Contribution report;
  camera_->contribute(report);
  ASSERT_EQ(report.events.size(), 1U);
  EXPECT_EQ(report.events[0].text,
            "camera front: the time between images is 2.5 periods of the task, no whole number; each is "
            "taken at the nearest "
            "release");
  ASSERT_EQ(report.lists.size(), 1U);
  EXPECT_EQ(report.lists[0].list, "cameras");
  EXPECT_EQ(report.lists[0].properties[0].key, "images");
  EXPECT_EQ(std::get<std::int64_t>(report.lists[0].properties[0].value), 5);
}

TEST_F(CameraTest, IsRefusedForABodyOrALayerThatIsMissing) {
  EXPECT_THROW(make_camera("carrier: nobody"), SetupError);
  EXPECT_THROW(make_camera("layers: [nowhere]"), SetupError);
}

}  // namespace
}  // namespace hil::modules
