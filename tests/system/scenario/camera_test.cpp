// A camera in a run: a box passes in front of another one. Its object list against closed forms, its files,
// and what the report shows of it.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "tests/paths.h"
#include "tests/support/png_reader.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// A pixel of the camera is 0.25 m wide at the front of the passing box and 0.5 m at that of the other one.
/// The passing box moves to the right by a pixel from one image to the next.
const char* const scene = R"(
scenario: camera
base_rate: 10 Hz
duration: 3 s
clock: virtual
seed: 9
world:
  materials:
    - {name: red, base_color: [0.6, 0.1, 0.1]}
    - {name: white, base_color: [0.8, 0.8, 0.8]}
  lights:
    - {name: daylight, kind: sky, zenith: 5000 cd/m2, horizon: 5000 cd/m2, ground: 1000 cd/m2}
  entities:
    - {name: sky, light: daylight}
    - {name: back, shape: {box: [1 m, 8 m, 8 m]}, position: [16.5 m, 0 m, 0 m], material: white}
    - {name: passing, shape: {box: [1 cm, 2 m, 2 m]}, position: [8.005 m, 3.75 m, 0 m],
       velocity: [0 m/s, -2.5 m/s, 0 m/s], material: red}
tasks:
  - module: front
    type: camera
    rate: 10 Hz
    parameters:
      resolution: [64, 48]
      field_of_view: 90 deg
      samples: 4
      bounces: 1
      noise: {full_well: 2000, read_noise: 10}
      depth_files: {step: 1 mm}
      objects: 2
)";

class CameraRun : public ::testing::Test {
 protected:
  std::string run(const std::string& out, const std::vector<std::string>& more = {}) {
    write_text(folder_ / "scene.yaml", scene);
    const Ended ended = run_hil(joined({{"run", folder_ / "scene.yaml", "--out", folder_ / out}, more}));
    // Nothing is expected of the run, so it does not pass.
    EXPECT_LE(ended.code, 1) << ended.output << ended.errors;
    return folder_ / out;
  }
  static std::map<std::string, std::string> images_in(const std::string& out) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(out + "/images"))
      files[entry.path().filename().string()] = tests::content_of(entry.path());
    return files;
  }

  const Folder folder_;
};

TEST_F(CameraRun, ListsBoxesAndSharesOfAPassingBox) {
  const std::string out = run("out");
  const Signals signals(out);
  ASSERT_EQ(signals.rows(), 30U);
  const auto value = [&](const std::string& name, std::size_t row) { return signals["front." + name][row]; };
  for (std::size_t image = 0; image < 30; ++image) {
    EXPECT_EQ(value("image_count", image), static_cast<double>(image + 1));
    EXPECT_EQ(value("object_count", image), 2.0);
    const double left = 13.0 + static_cast<double>(image);  // of the passing box, 8 pixels wide
    EXPECT_EQ(value("object0.x_min", image), left);
    EXPECT_EQ(value("object0.x_max", image), left + 8.0);
    EXPECT_EQ(value("object0.y_min", image), 20.0);
    EXPECT_EQ(value("object0.y_max", image), 28.0);
    EXPECT_NEAR(value("object0.depth", image), 8.0, 1e-5);
    EXPECT_EQ(value("object0.share", image), 1.0);
    // The other one has 16 * 16 pixels, from column 24 on; the passing box hides 8 rows of them.
    const double columns = std::clamp(std::min(left + 8.0, 40.0) - std::max(left, 24.0), 0.0, 8.0);
    EXPECT_EQ(value("object1.pixels", image), 256.0 - 8.0 * columns) << image;
    EXPECT_DOUBLE_EQ(value("object1.share", image), 1.0 - columns / 32.0) << image;
    EXPECT_EQ(value("object1.share_exact", image), 1.0);
    EXPECT_EQ(value("object1.x_min", image), 24.0);
    EXPECT_EQ(value("object1.y_max", image), 32.0);
    EXPECT_NEAR(value("object1.depth", image), 16.0, 1e-5);
  }
  const nlohmann::json world = nlohmann::json::parse(read_text(out + "/world.json"));
  std::map<std::string, double> index;
  for (const auto& entity : world["entities"])
    index[entity["name"]] = entity["index"];
  EXPECT_EQ(value("object0.entity", 5), index.at("passing"));
  EXPECT_EQ(value("object1.entity", 5), index.at("back"));
}

TEST_F(CameraRun, SendsItsObjectsOnCan) {
  write_text(
      folder_ / "bus.dbc",
      "VERSION \"\"\nBU_: A B\nBO_ 256 CameraObject: 8 A\n SG_ Left : 0|16@1+ (1,0) [0|65535] \"\" B\n"
      " SG_ Depth : 16|16@1+ (0.01,0) [0|655.35] \"m\" B\n"
      " SG_ Share : 32|16@1+ (0.0009765625,0) [0|1] \"\" B\n SG_ Valid : 48|1@1+ (1,0) [0|1] \"\" B\n");
  write_text(folder_ / "scene.yaml",
             std::string(scene) +
                 "can:\n  - bus: car\n    device: virtual\n    database: bus.dbc\n    rate: 10 Hz\n"
                 "    send:\n      - {message: CameraObject, period: 100 ms, signals: {Left: "
                 "front.object1.x_min, Depth: front.object1.depth, Share: front.object1.share, Valid: "
                 "front.object1.valid}}\n");
  const Ended ended = run_hil({"run", folder_ / "scene.yaml", "--out", folder_ / "out"});
  ASSERT_LE(ended.code, 1) << ended.output << ended.errors;
  const auto frames = read_can_log(folder_ / "out/can-car.log");
  ASSERT_GE(frames.size(), 28U);
  const auto word = [&](const io::can::LoggedFrame& one, std::size_t first) {
    return one.frame.raw.data[first] + 256 * one.frame.raw.data[first + 1];
  };
  std::set<int> shares;
  for (const auto& one : frames) {
    if (one.frame.raw.data[6] == 0) continue;  // before the first image
    EXPECT_EQ(word(one, 0), 24);
    EXPECT_EQ(word(one, 2), 1600);
    shares.insert(word(one, 4));
  }
  // In units of 1/1024: the passing box hides 0 to 8 of 32 parts, one more or less from an image to the next.
  EXPECT_EQ(shares, (std::set<int>{768, 800, 832, 864, 896, 928, 960, 992, 1024}));
}

TEST_F(CameraRun, TheExampleOfTheGuideHasNoMistakes) {
  const std::string page = read_text(std::string(HIL_SOURCE_DIR) + "/docs/guide/camera.md");
  const std::string fence = "```yaml\n";
  const std::size_t begin = page.find(fence) + fence.size();
  write_text(folder_ / "example.yaml", page.substr(begin, page.find("```", begin) - begin));
  const Ended ended = run_hil({"run", folder_ / "example.yaml", "--out", folder_ / "out"});
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  EXPECT_EQ(images_in(folder_ / "out").size(), 40U) << "20 images, and their depths";
}

/// configs/camera/rolling_shutter.yaml: its expectations hold, and fail without the time between rows.
TEST_F(CameraRun, RollingShutterShearsAPassingVan) {
  const std::string scenario = std::string(HIL_SOURCE_DIR) + "/configs/camera/rolling_shutter.yaml";
  const std::vector<std::string> fast{"run",   scenario,
                                      "--set", "tasks.global.parameters.samples=1",
                                      "--set", "tasks.rolling.parameters.samples=1",
                                      "--out", folder_ / "out"};
  Ended ended = run_hil(fast);
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  ended = run_hil(joined({fast, {"--set", "tasks.rolling.parameters.row_time=0 s"}}));
  EXPECT_EQ(ended.code, 1) << ended.output << ended.errors;
  EXPECT_NE(ended.output.find("its shear is speed times row time"), std::string::npos) << ended.output;
}

TEST_F(CameraRun, WritesTheSameFilesInEachRun) {
  const std::string out = run("out");
  const auto files = images_in(out);
  EXPECT_EQ(files.size(), 60U) << "an image and a depth for each tick";
  const tests::PngContent depth = tests::read_png(out + "/images/camera-front-000015-depth.png");
  ASSERT_EQ(depth.samples.size(), 64U * 48U);
  EXPECT_EQ(depth.bits, 16);
  for (std::size_t y = 0; y < 48; ++y) {
    for (std::size_t x = 0; x < 64; ++x) {
      const bool on_passing = x >= 28 && x < 36 && y >= 20 && y < 28;
      const bool on_back = x >= 24 && x < 40 && y >= 16 && y < 32;
      EXPECT_EQ(depth.samples[64 * y + x], on_passing ? 8000 : on_back ? 16000 : 0) << x << " " << y;
    }
  }
  const tests::PngContent image = tests::read_png(out + "/images/camera-front-000015.png");
  ASSERT_EQ(image.samples.size(), 64U * 48U * 3U);
  const auto color = [&](std::size_t x, std::size_t y) { return &image.samples[3 * (64 * y + x)]; };
  EXPECT_GT(color(32, 24)[0], color(32, 24)[1] + 50) << "the passing box is red";
  EXPECT_GT(color(25, 17)[1], 130) << "the other one is white";
  EXPECT_EQ(images_in(run("again")), files);
  const auto other = images_in(run("other", {"--seed", "10"}));
  EXPECT_NE(other.at("camera-front-000015.png"), files.at("camera-front-000015.png"));
  EXPECT_EQ(other.at("camera-front-000015-depth.png"), files.at("camera-front-000015-depth.png"));
}

TEST_F(CameraRun, ItsReportShowsTheLastImage) {
  const std::string out = run("out", {"--set", "tasks.front.parameters.exposure_value=11.5"});
  const auto report = read_report(out);
  ASSERT_EQ(report["lists"]["cameras"].size(), 1U);
  const auto& camera = report["lists"]["cameras"][0];
  EXPECT_EQ(camera["name"], "front");
  EXPECT_EQ(camera["images"], 30);
  EXPECT_EQ(camera["dropped"], 0);
  EXPECT_EQ(camera["beyond_limit"], 0);
  EXPECT_EQ(camera["missing_tiles"], 0);
  EXPECT_EQ(camera["exposure_value"], 11.5);
  EXPECT_EQ(camera["last_file"], "images/camera-front-000029.png");
  EXPECT_EQ(camera["last_tick"], 29);
  EXPECT_EQ(camera["last_time_ns"], 2'900'000'000);
  ASSERT_EQ(report["sections"].size(), 1U);
  EXPECT_EQ(report["sections"][0]["title"], "Cameras");
  ASSERT_EQ(report["sections"][0]["images"].size(), 1U);
  const auto& image = report["sections"][0]["images"][0];
  const std::string page = read_text(out + "/report.html");
  EXPECT_NE(page.find("src=\"data:image/png;base64," + image["png"].get<std::string>() + "\""),
            std::string::npos);
  EXPECT_NE(page.find("Tick 29, 2.900 s. Exposure value 11.5, images/camera-front-000029.png."),
            std::string::npos);
}

TEST_F(CameraRun, ImagesThatAreNotEquallySpacedAreAnEvent) {
  const std::string out = run("out", {"--set", "tasks.front.parameters.frames_per_second=4 Hz", "--set",
                                      "tasks.front.parameters.depth_files.step=1 cm"});
  std::set<std::string> names;
  for (const auto& [name, content] : images_in(out))
    if (name.find("depth") == std::string::npos) names.insert(name);
  EXPECT_EQ(names.size(), 12U);
  for (const char* name : {"camera-front-000000.png", "camera-front-000003.png", "camera-front-000005.png",
                           "camera-front-000008.png", "camera-front-000010.png"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_NE(
      events_in_ms(read_report(out)).find("camera front: the time between images is 2.5 periods of the task"),
      std::string::npos);
}

TEST_F(CameraRun, MistakesHaveTheirPlaces) {
  write_text(folder_ / "scene.yaml", scene);
  const std::pair<const char*, const char*> wrong[] = {
      {"resolution=[0, 48]", "0"},
      {"resolution=[16384, 16384]", "'resolution' has 268435456 pixels; at most 16777216 are possible"},
      {"field_of_view=180 deg", "179 deg"},
      {"carrier=car", "car"},
      {"layers=[nowhere]", "nowhere"},
  };
  for (const auto& [setting, message] : wrong) {
    const Ended ended =
        run_hil({"check", folder_ / "scene.yaml", "--set", std::string("tasks.front.parameters.") + setting});
    EXPECT_EQ(ended.code, 2) << setting;
    EXPECT_NE((ended.output + ended.errors).find(message), std::string::npos) << setting << "\n"
                                                                              << ended.output << ended.errors;
  }
}

}  // namespace
}  // namespace hil::scenario_test
