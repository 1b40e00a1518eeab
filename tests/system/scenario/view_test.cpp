// Views of the world: in the report of a run, and at any time of its history, where a camera's image is that
// of the run.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <tuple>

#include "tests/paths.h"
#include "tests/support/png_reader.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/two_blocks.hpp"

namespace hil::scenario_test {
namespace {

/// A cart with two cameras passes boxes. Without noise the device makes sRGB pixels, with noise the sensor
/// does.
const char* const street = R"(
scenario: street
base_rate: 10 Hz
duration: 1 s
clock: virtual
seed: 9
world:
  layers: [body, hidden]
  materials:
    - {name: red, base_color: [0.6, 0.1, 0.1]}
  lights:
    - {name: daylight, kind: sky, zenith: 5000 cd/m2, horizon: 5000 cd/m2, ground: 1000 cd/m2}
  entities:
    - {name: sky, light: daylight, mask: [body, hidden]}
    - {name: cart, shape: {box: [1 m, 1 m, 0.5 m]}, velocity: [2 m/s, 0 m/s, 0 m/s],
       angular_velocity: [0 deg/s, 0 deg/s, 20 deg/s], mask: [hidden]}
    - {name: near, shape: {box: [1 m, 1 m, 2 m]}, position: [8 m, 1 m, 0 m], material: red, mask: [body]}
    - {name: far, shape: {sphere: {radius: 2 m}}, position: [14 m, -1 m, 0 m], mask: [body]}
  views:
    - {name: corner, position: [-6 m, -9 m, 5 m], look_at: [6 m, 0 m, 0 m], resolution: [64, 48]}
    - {name: above, carrier: cart, position: [0 m, 0 m, 12 m], look_at: [0 m, 0 m, 0 m],
       resolution: [32, 32], layers: [hidden], mode: path_traced, samples: 2}
tasks:
  - module: rolling
    type: camera
    rate: 10 Hz
    parameters:
      carrier: cart
      mount: [0.6 m, 0 m, 0.4 m]
      rotation: {pitch: 2 deg}
      resolution: [64, 48]
      field_of_view: 80 deg
      row_time: 1 ms
      exposure_time: 4 ms
      samples: 4
      layers: [body]
      noise: {full_well: 2000, read_noise: 10}
      depth_files: {step: 1 mm}
  - module: plain
    type: camera
    rate: 5 Hz
    parameters: {carrier: cart, resolution: [64, 48], mode: real_time, samples: 2, layers: [body]}
)";

class Views : public ::testing::Test {
 protected:
  std::string run(const std::string& scenario, const std::vector<std::string>& more = {}) {
    write_text(folder_ / "street.yaml", scenario);
    const Ended ended = run_hil(joined({{"run", folder_ / "street.yaml", "--out", folder_ / "out"}, more}));
    EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
    return folder_ / "out";
  }
  /// The refusal of `hil history DIR image`.
  std::string refusal(const std::string& out, const std::vector<std::string>& arguments) {
    const Ended ended =
        run_hil(joined({{"history", out, "image", "--file", folder_ / "refused.png"}, arguments}));
    EXPECT_EQ(ended.code, 2) << ended.output << ended.errors;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "refused.png"));
    return ended.errors;
  }

  const Folder folder_;
};

TEST_F(Views, AnImageOfTheHistoryIsThatOfTheRun) {
  const std::string out = run(street);
  const std::string color = folder_ / "color.png", depth = folder_ / "depth.png";
  const auto image = [&](const char* camera, const std::string& tick, const char* what) {
    std::string name("camera-");
    name.append(camera).append("-").append(tick).append(what);
    return tests::content_of(std::filesystem::path(out) / "images" / name);
  };
  for (const auto& [time, tick] :
       std::map<std::string, std::string>{{"0 s", "000000"}, {"0.4s", "000004"}, {"800ms", "000008"}}) {
    answer({"history", out, "--json", "image", "--camera", "rolling", "--at", time, "--file", color,
            "--depth-file", depth});
    EXPECT_EQ(tests::content_of(color), image("rolling", tick, ".png")) << time;
    EXPECT_EQ(tests::content_of(depth), image("rolling", tick, "-depth.png")) << time;
    answer({"history", out, "--json", "image", "--camera", "plain", "--at", time, "--file", color});
    EXPECT_EQ(tests::content_of(color), image("plain", tick, ".png")) << time;
  }
  const Json info = answer({"history", out, "--json", "info"});
  EXPECT_EQ(info["cameras"], (Json{"rolling", "plain", "corner", "above"}));
}

TEST_F(Views, TheReportShowsThemAtTheEndOfTheRun) {
  const std::string out = run(street);
  const Json report = read_report(out);
  ASSERT_EQ(report["views"].size(), 2U);
  const Json& corner = report["views"][0];
  EXPECT_EQ(corner["name"], "corner");
  EXPECT_EQ(corner["time_ns"], 1'000'000'000);
  EXPECT_EQ(corner["in_daylight"], false);
  EXPECT_EQ(corner["incomplete_pixels"], 0);
  EXPECT_EQ(corner["file"], "images/view-corner.png");
  const tests::PngContent picture = tests::read_png(out + "/images/view-corner.png");
  ASSERT_EQ(picture.samples.size(), 64U * 48U * 3U);
  const std::string page = read_text(out + "/report.html");
  EXPECT_NE(page.find("src=\"data:image/png;base64," + corner["image_png"].get<std::string>() + "\""),
            std::string::npos);
  // The history makes the same picture, and lists what it shows.
  const std::string again = folder_ / "again.png";
  const Json seen = answer(
      {"history", out, "--json", "image", "--camera", "corner", "--at", "1s", "--file", again})["answers"][0];
  EXPECT_EQ(tests::content_of(again), tests::content_of(out + "/images/view-corner.png"));
  EXPECT_NEAR(seen["exposure_value"].get<double>(), corner["exposure_value"].get<double>(), 1e-12);
  std::vector<std::string> names;
  for (const Json& body : seen["bodies"])
    names.push_back(body["name"]);
  EXPECT_EQ(names, (std::vector<std::string>{"cart", "near", "far"}));
  // What the views read is no part of the run.
  EXPECT_EQ(
      run_hil({"run", folder_ / "street.yaml", "--set", "world.views=[]", "--out", folder_ / "without"}).code,
      0);
  const Json without = read_report(folder_ / "without");
  EXPECT_EQ(without["transactions"], report["transactions"]);
  EXPECT_TRUE(without["views"].empty());
  // From above its carrier the second view sees only the cart, in the middle of the image.
  const Json above = answer(
      {"history", out, "--json", "image", "--camera", "above", "--at", "1s", "--file", again})["answers"][0];
  ASSERT_EQ(above["bodies"].size(), 1U);
  EXPECT_EQ(above["bodies"][0]["name"], "cart");
  EXPECT_NEAR(above["bodies"][0]["depth_m"].get<double>(), 11.75, 1e-4);
  const Json box = above["bodies"][0]["box"];
  EXPECT_EQ(box[0].get<int>() + box[2].get<int>(), 32);
  EXPECT_EQ(box[1].get<int>() + box[3].get<int>(), 32);
  EXPECT_EQ(tests::content_of(again), tests::content_of(out + "/images/view-above.png"));
}

TEST_F(Views, ACameraCanStandAnywhere) {
  const std::string out = run(street);
  const std::string file = folder_ / "free.png";
  const std::vector<std::string> image{"history", out, "--json", "image"};
  // Beside the front of the near box, whose left half fills the lower right quarter and more.
  const Json still =
      answer(joined({image,
                     {"--position", "0,1,0", "--look-at", "8,1,0", "--size", "40,20", "--field-of-view",
                      "90deg", "--at", "0s", "--file", file}}))["answers"][0];
  EXPECT_EQ(still["width"], 40);
  const Json& body = still["bodies"][0];
  EXPECT_EQ(body["name"], "near");
  EXPECT_NEAR(body["depth_m"].get<double>(), 7.5, 1e-5);
  // 1 m at 7.5 m in an image of 15 m: 2.67 of 40 columns.
  EXPECT_EQ(body["box"][2].get<int>() - body["box"][0].get<int>(), 2);
  EXPECT_EQ(tests::read_png(file).samples.size(), 40U * 20U * 3U);

  // With the cart: it moves towards the box, which gets larger.
  const Json series = answer(joined({image,
                                     {"--position", "1,0,0", "--look-at", "5,0,0", "--carried-by", "cart",
                                      "--layers", "body", "--at", "0s", "--until", "1s", "--every", "500ms",
                                      "--size", "40,20", "--file", folder_ / "series.png"}}))["answers"];
  ASSERT_EQ(series.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(series[k]["file"], folder_ / ("series-000" + std::to_string(k) + ".png"));
    EXPECT_EQ(tests::read_png(series[k]["file"].get<std::string>()).samples.size(), 40U * 20U * 3U);
  }
  EXPECT_LT(series[2]["bodies"][0]["depth_m"], series[0]["bodies"][0]["depth_m"]);

  const auto mean = [&](const std::vector<std::string>& how) {
    answer(joined({image, {"--camera", "corner", "--at", "1s", "--file", file}, how}));
    const tests::PngContent picture = tests::read_png(file);
    double sum = 0.0;
    for (const auto sample : picture.samples)
      sum += sample;
    return sum / static_cast<double>(picture.samples.size());
  };
  const double usual = mean({});
  EXPECT_GT(usual, 80.0) << "exposed by its brightness";
  EXPECT_LT(usual, 190.0);
  EXPECT_NEAR(mean({"--mode", "path_traced", "--samples", "32"}), usual, 0.05 * usual);
  EXPECT_LT(mean({"--exposure-value", "20"}), 10.0);
}

TEST_F(Views, AWorldWithoutLightsIsSeenInDaylight) {
  std::string dark = street;
  const std::string lamp = "    - {name: sky, light: daylight, mask: [body, hidden]}\n";
  dark.erase(dark.find(lamp), lamp.size());
  const std::string out = run(dark);
  const Json report = read_report(out);
  EXPECT_EQ(report["views"][0]["in_daylight"], true);
  const tests::PngContent picture = tests::read_png(out + "/images/view-corner.png");
  EXPECT_GT(*std::ranges::max_element(picture.samples), 200);
  EXPECT_NE(read_text(out + "/report.html").find("in daylight, since it sees no light of the world"),
            std::string::npos);
  EXPECT_NE(run_hil({"check", folder_ / "street.yaml"}).errors.find("the images of module plain are black"),
            std::string::npos);
  const Json still = answer({"history", out, "--json", "image", "--camera", "plain", "--at", "0s", "--file",
                             folder_ / "black.png"})["answers"][0];
  EXPECT_EQ(still["is_dark"], true);
  const tests::PngContent camera = tests::read_png(out + "/images/camera-plain-000000.png");
  EXPECT_EQ(*std::ranges::max_element(camera.samples), 0) << "a camera of the run shows the world as it is";
}

TEST_F(Views, WhatCanNotBeDrawnIsRefused) {
  const std::string out = run(street);
  const std::vector<std::string> at{"--at", "1s"};
  EXPECT_NE(refusal(out, at).find("give one of --camera and --position"), std::string::npos);
  const std::pair<std::vector<std::string>, const char*> wrong[] = {
      {{"--camera", "corner", "--position", "0,0,0"}, "give one of --camera and --position"},
      {{"--camera", "korner"}, "the run has no camera 'korner'; did you mean 'corner'?"},
      {{"--camera", "corner", "--carried-by", "cart"}, "are for --position"},
      {{"--position", "0,0,0"}, "--position needs --look-at"},
      {{"--position", "0,0,0", "--look-at", "0,0,0"}, "--look-at is --position"},
      {{"--position", "0,0,nan", "--look-at", "1,0,0"}, "--position: not every number is finite"},
      {{"--position", "0,0,1e6", "--look-at", "1,0,0"},
       "--position: 1e+06 m is out of range; -1e+05 to 1e+05 m are possible"},
      {{"--position", "0,0,9", "--look-at", "1,0,0", "--carried-by", "kart"}, "did you mean 'cart'?"},
      {{"--camera", "corner", "--size", "0,48"}, "--size: 0 is out of range; 1 to 16384 are possible"},
      {{"--camera", "corner", "--size", "-1,48"}, "--size: -1 is out of range"},
      {{"--camera", "corner", "--size", "1.5,48"}, "--size: 1.5 is not whole"},
      {{"--camera", "corner", "--size", "16384,16384"}, "1 to 67108864 are possible"},
      {{"--camera", "corner", "--field-of-view", "180deg"},
       "--field-of-view: 180 deg is out of range; 0.01 to 179 deg are possible"},
      {{"--camera", "corner", "--field-of-view", "60"}, "--field-of-view 60"},
      {{"--camera", "corner", "--samples", "0"}, "--samples: 0 is out of range; 1 to 65536 are possible"},
      {{"--camera", "corner", "--bounces", "65"}, "--bounces: 65 is out of range; 0 to 64 are possible"},
      {{"--camera", "corner", "--exposure-value", "31"}, "--exposure-value: 31 is out of range"},
      {{"--camera", "corner", "--layers", "bodi"}, "did you mean 'body'?"},
      {{"--camera", "corner", "--depth-step", "1mm"}, "--depth-step needs --depth-file"},
      {{"--camera", "corner", "--depth-file", folder_ / "d.png", "--depth-step", "0m"},
       "--depth-step 0m: 0.01 mm to 10 m are possible"},
      {{"--camera", "corner", "--depth-file", folder_ / "refused.png"},
       "--file and --depth-file are the same file"},
      {{"--camera", "corner", "--depth-file", folder_ / "d.jpg"}, "the name of a PNG file ends with .png"},
      {{"--camera", "corner", "--depth-file", out + "/images/d.png"}, "is in the folder of the run"},
  };
  for (const auto& [arguments, message] : wrong) {
    const std::string said = refusal(out, joined({at, arguments}));
    EXPECT_NE(said.find(message), std::string::npos) << message << "\n" << said;
  }
  const Ended overwriting =
      run_hil(joined({{"history", out, "image", "--camera", "corner", "--file", out + "/report.json"}, at}));
  EXPECT_EQ(overwriting.code, 2);
  EXPECT_EQ(read_report(out)["views"].size(), 2U) << "the run's own files are as before";
  EXPECT_NE(refusal(out, {"--camera", "corner", "--at", "2s"}).find("after the end of the run"),
            std::string::npos);
  const Ended unwritten = run_hil(
      joined({{"history", out, "image", "--camera", "corner", "--file", folder_ / "no/folder.png"}, at}));
  EXPECT_EQ(unwritten.code, 4);
  EXPECT_NE(unwritten.errors.find("folder.png"), std::string::npos) << unwritten.errors;
}

/// A view that takes minutes.
TEST_F(Views, AnInterruptEndsTheDrawing) {
  std::string slow = street;
  const std::string size = "resolution: [64, 48]}";
  slow.replace(slow.find(size), size.size(),
               "resolution: [1024, 1024], mode: path_traced, samples: 64, bounces: 8}");
  write_text(folder_ / "street.yaml", slow);
  const std::string out = folder_ / "out";
  Program program(hil({"run", folder_ / "street.yaml", "--out", out}));
  ASSERT_TRUE(eventually([&] {
    return std::filesystem::exists(out + "/run.log") &&
           read_text(out + "/run.log").find("draws 2 views") != std::string::npos;
  }));
  program.signal(SIGINT);
  const Ended ended = program.wait(std::chrono::seconds(60));
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  const Json report = read_report(out);
  EXPECT_TRUE(report["views"].empty());
  EXPECT_NE(report["failures"].dump().find("the view corner is missing: the drawing was stopped"),
            std::string::npos);
}

TEST_F(Views, MistakesHaveTheirPlaces) {
  const auto mistake = [&](const std::string& from, const std::string& to) {
    std::string changed = street;
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    write_text(folder_ / "street.yaml", changed);
    const Ended ended = run_hil({"check", folder_ / "street.yaml"});
    EXPECT_EQ(ended.code, 2) << to;
    return ended.output + ended.errors;
  };
  const std::tuple<const char*, const char*, const char*> wrong[] = {
      {"look_at: [6 m, 0 m, 0 m]", "look_at: [-6 m, -9 m, 5 m]",
       "street.yaml:20:60: 'look_at' is 'position', so the view has no direction; give another point"},
      {"name: above", "name: corner", "corner"},
      {"name: above", "name: plain", "'plain' is the name of a module; give the view another name"},
      {"carrier: cart, position", "carrier: kart, position", "there is no body 'kart'; did you mean 'cart'?"},
      {"carrier: cart, position", "carrier: sky, position", "the entity 'sky' has no shape"},
      {"layers: [hidden]", "layers: [hiden]", "there is no layer 'hiden'; did you mean 'hidden'?"},
      {"resolution: [64, 48]}", "resolution: [0, 48]}", "0"},
  };
  for (const auto& [from, to, message] : wrong) {
    const std::string said = mistake(from, to);
    EXPECT_NE(said.find(message), std::string::npos) << message << "\n" << said;
  }
  EXPECT_NE(mistake("resolution: [64, 48]}", "resolution: [4096, 4096], samples: 5}")
                .find("the view has 83886080 points (pixels times samples)"),
            std::string::npos);
  EXPECT_NE(mistake("resolution: [64, 48]}", "resolution: [2048, 2048], mode: path_traced}")
                .find("the view has 268435456 points"),
            std::string::npos)
      << "64 samples by default";
  EXPECT_NE(mistake("look_at: [6 m, 0 m, 0 m], resolution: [64, 48]",
                    "look_at: [6 m, 0 m, 0 m], resolution: [4, 4096], field_of_view: 179 deg")
                .find("'field_of_view' is horizontal"),
            std::string::npos);
}

}  // namespace
}  // namespace hil::scenario_test
