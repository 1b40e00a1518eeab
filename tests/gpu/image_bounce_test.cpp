// Images in real time: what rays from the first surface find, against closed forms and against the path
// tracer.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <iostream>
#include <numbers>
#include <vector>

#include "tests/gpu/image_fixture.hpp"

namespace rtstdb::test {
namespace {

using std::numbers::pi;

glm::dquat turned_by(double yaw_rad, double pitch_rad) {
  return glm::angleAxis(yaw_rad, glm::dvec3(0.0, 0.0, 1.0)) *
         glm::angleAxis(pitch_rad, glm::dvec3(0.0, 1.0, 0.0));
}

Material painted(const glm::dvec3& color) {
  return {.base_color = color, .refractive_index = 1.0};
}

Light white_sky(double luminance_cdpm2) {
  const glm::dvec3 all(luminance_cdpm2);
  return {.kind = LightKind::sky, .zenith_cdpm2 = all, .horizon_cdpm2 = all, .ground_cdpm2 = all};
}

class ImageInRealTime : public ImageTest {
 protected:
  void SetUp() override {
    ImageTest::SetUp();
    if (!database().device().draws) GTEST_FAIL() << "the device can not draw";
  }
  static ImageQueryOptions real_time(std::uint32_t bounces, std::uint32_t side = 16) {
    return {.width = side,
            .height = side,
            .mode = ImageMode::real_time,
            .outputs = linear_color,
            .first_hits = FirstHits::rasterised,
            .samples_per_pixel = 1,
            .bounces = bounces,
            .shadows = Shadows::mapped};
  }
  static ImageQueryOptions path_traced(std::uint32_t bounces, std::uint32_t samples,
                                       std::uint32_t side = 16) {
    return {.width = side,
            .height = side,
            .outputs = linear_color,
            .samples_per_pixel = samples,
            .bounces = bounces};
  }
  /// Looks straight down from 1 m above the origin.
  static Camera down() {
    return {
        .p_m = {0.0f, 0.0f, 1.0f}, .q = glm::quat(turned_by(0.0, pi / 2.0)), .horizontal_angle_rad = 0.002f};
  }
};

/// A black plate hides half of the sky, or nearly all of it.
TEST_F(ImageInRealTime, APlateHidesItsPartOfTheSky) {
  const double albedo = 0.6;
  create_light(white_sky(1000.0));
  create_body(add(make_rectangle(50.0, 50.0)), {}, painted(glm::dvec3(albedo)));
  const GeometryId plate = add(make_rectangle(40.0, 40.0));
  EXPECT_NEAR(mean_color(image_of(down(), real_time(2))).x, albedo * 1000.0, 1.0);
  const EntityId half = create_body(plate, {20.0, 0.0, 2.0}, painted(glm::dvec3(0.0)));
  EXPECT_NEAR(mean_color(image_of(down(), real_time(2))).x, albedo * 500.0, 0.07 * albedo * 1000.0);
  EXPECT_NEAR(mean_color(image_of(down(), real_time(1))).x, albedo * 1000.0, 1.0)
      << "without rays into lobes";
  remove(half, {});
  create_body(plate, {0.0, 0.0, 1.5}, painted(glm::dvec3(0.0)));
  EXPECT_NEAR(mean_color(image_of(down(), real_time(2))).x, 0.0, 1e-3);
}

/// The sun lights a plate above the ground, which sees nothing else.
TEST_F(ImageInRealTime, ALitPlateLightsTheGround) {
  const double albedo = 0.6, illuminance_lx = 1e4, pitch_rad = 0.6;
  // The sun shines onto the plate from below, past the ground.
  create_body(add(make_rectangle(2.0, 2.0)), {}, painted(glm::dvec3(albedo)));
  create_body(add(make_rectangle(40.0, 40.0)), {0.0, 0.0, 6.0}, painted({0.8, 0.4, 0.0}));
  create_light({.kind = LightKind::directional, .illuminance_lx = illuminance_lx}, {},
               turned_by(0.0, -pitch_rad));
  const glm::dvec3 color = mean_color(image_of(down(), real_time(2)));
  const double plate = illuminance_lx * std::sin(pitch_rad) / pi;
  // The plate ends before the horizon, and the ground's shadow is on it.
  EXPECT_NEAR(color.x, albedo * 0.8 * plate, 0.08 * albedo * plate);
  EXPECT_NEAR(color.y, albedo * 0.4 * plate, 0.08 * albedo * plate);
  EXPECT_EQ(color.z, 0.0);
}

TEST_F(ImageInRealTime, ASmoothMirrorShowsWhatThePathTracerShows) {
  create_light({.kind = LightKind::directional, .illuminance_lx = 1e4}, {}, turned_by(0.5, 0.8));
  create_body(add(make_rectangle(10.0, 10.0)), {5.0, 0.0, -1.0},
              {.base_color = glm::dvec3(0.9, 0.8, 0.7), .metallic = 1.0, .roughness = 0.0});
  create_body(add(make_box({1.0, 8.0, 6.0})), {9.0, 0.0, 1.0}, painted({0.7, 0.3, 0.2}));
  const Camera camera{.q = glm::quat(turned_by(0.0, 0.25)), .horizontal_angle_rad = 0.1f};
  const glm::dvec3 mirrored = mean_color(image_of(camera, real_time(2)));
  const glm::dvec3 expected = mean_color(image_of(camera, path_traced(2, 64)));
  EXPECT_GT(expected.x, 100.0);
  EXPECT_LT(glm::length(mirrored - expected), 0.02 * glm::length(expected));
}

TEST_F(ImageInRealTime, ARoughMirrorShowsAboutWhatThePathTracerShows) {
  create_light({.kind = LightKind::directional, .illuminance_lx = 1e4}, {}, turned_by(0.5, 0.8));
  for (const double roughness : {0.2, 0.4}) {
    const EntityId plate =
        create_body(add(make_rectangle(10.0, 10.0)), {5.0, 0.0, -1.0},
                    {.base_color = glm::dvec3(0.9), .metallic = 1.0, .roughness = roughness});
    const EntityId wall =
        create_body(add(make_box({1.0, 30.0, 30.0})), {9.0, 0.0, 0.0}, painted({0.7, 0.3, 0.2}));
    const Camera camera{.q = glm::quat(turned_by(0.0, 0.25)), .horizontal_angle_rad = 0.1f};
    const glm::dvec3 mirrored = mean_color(image_of(camera, real_time(2)));
    const glm::dvec3 expected = mean_color(image_of(camera, path_traced(2, 256)));
    EXPECT_GT(expected.x, 100.0);
    EXPECT_LT(glm::length(mirrored - expected), 0.05 * glm::length(expected)) << roughness;
    remove(plate, {});
    remove(wall, {});
  }
}

/// Mean luminance of squares of pixels, so that edges and noise matter little.
std::vector<double> of_squares(const Image& image) {
  constexpr std::uint32_t side = 8;
  std::vector<double> means;
  for (std::uint32_t y = 0; y < image.height; y += side)
    for (std::uint32_t x = 0; x < image.width; x += side)
      means.push_back(mean_color(image, {x, y}, {x + side, y + side}).y);
  return means;
}

/// The mean difference of real-time mode to the path tracer, as a share of the mean luminance.
double difference_of(const std::vector<double>& found, const std::vector<double>& expected) {
  double sum = 0.0, difference = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    sum += expected[i];
    difference += std::abs(found[i] - expected[i]);
  }
  return difference / sum;
}

class ImageScenes : public ImageInRealTime {
 protected:
  void expect_direct_light(const char* name, const Camera& camera, std::uint32_t emitter_points = 16) {
    ImageQueryOptions options = real_time(1, 64);
    options.samples_per_pixel = 4;
    options.emitter_points = emitter_points;
    const auto found = of_squares(image_of(camera, options));
    const auto expected = of_squares(image_of(camera, path_traced(1, 64, 64)));
    const double direct = difference_of(found, expected);
    options.bounces = 3;
    options.samples_per_pixel = 1;
    const auto all_found = of_squares(image_of(camera, options));
    const auto all_expected = of_squares(image_of(camera, path_traced(3, 64, 64)));
    std::cout << name << ": direct light " << 100.0 * direct << " %, all light "
              << 100.0 * difference_of(all_found, all_expected) << " % off\n";
    EXPECT_LT(direct, 0.05) << name;
  }
};

TEST_F(ImageScenes, AStreetInTheSun) {
  create_light({.kind = LightKind::directional, .illuminance_lx = 8e4}, {}, turned_by(0.7, 0.7));
  create_body(add(make_rectangle(200.0, 200.0)), {}, painted(glm::dvec3(0.3)));
  create_body(add(make_box({10.0, 10.0, 12.0})), {25.0, 12.0, 6.0}, painted({0.6, 0.5, 0.4}));
  create_body(add(make_box({10.0, 20.0, 6.0})), {35.0, -15.0, 3.0}, painted(glm::dvec3(0.7)));
  create_body(add(make_box({4.0, 1.8, 1.5})), {14.0, -2.0, 0.75}, painted({0.6, 0.1, 0.1}));
  create_body(add(make_sphere(1.0, 4)), {12.0, 3.0, 1.0},
              {.base_color = glm::dvec3(0.8), .metallic = 1.0, .roughness = 0.3});
  expect_direct_light("street", {.p_m = {0.0f, 0.0f, 3.0f}, .q = glm::quat(turned_by(0.0, 0.15))});
}

TEST_F(ImageScenes, AHallWithLamps) {
  create_body(add(make_box({20.0, 16.0, 6.0})), {6.0, 0.0, 3.0}, painted(glm::dvec3(0.7)));
  create_light({.kind = LightKind::point, .intensity_cd = 3000.0}, {4.0, -3.0, 4.5});
  create_light(
      {.kind = LightKind::spot, .intensity_cd = 8000.0, .inner_angle_rad = 0.5, .outer_angle_rad = 1.0},
      {8.0, 4.0, 5.5}, turned_by(0.0, pi / 2.0));
  create_body(add(make_box({1.5, 1.5, 1.5})), {8.0, 3.5, 0.75}, painted({0.2, 0.5, 0.2}));
  create_body(add(make_box({2.0, 1.0, 2.0})), {6.0, -2.0, 1.0},
              {.base_color = glm::dvec3(0.6), .roughness = 0.3});
  expect_direct_light("hall", {.p_m = {-2.0f, 0.0f, 2.5f}, .q = glm::quat(turned_by(0.0, 0.15))});
}

TEST_F(ImageScenes, ATableUnderALargeLamp) {
  create_body(add(make_rectangle(12.0, 12.0)), {4.0, 0.0, 0.0}, painted(glm::dvec3(0.6)));
  create_body(add(make_box({1.6, 1.6, 0.02})), {4.0, 0.0, 3.0},
              {.base_color = glm::dvec3(0.0), .emission_cdpm2 = glm::dvec3(4000.0), .refractive_index = 1.0});
  create_body(add(make_box({0.8, 0.8, 0.8})), {3.5, 0.6, 0.4}, painted({0.7, 0.4, 0.2}));
  create_body(add(make_sphere(0.5, 4)), {4.2, -0.7, 0.5}, painted(glm::dvec3(0.8)));
  expect_direct_light("table", {.p_m = {0.0f, 0.0f, 2.0f}, .q = glm::quat(turned_by(0.0, 0.4))}, 64);
}

}  // namespace
}  // namespace rtstdb::test
