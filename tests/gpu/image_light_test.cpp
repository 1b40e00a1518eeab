// Light in images, against closed forms, in both modes where both have to find the same.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/gpu/image_fixture.hpp"
#include "tests/support/random.hpp"

namespace rtstdb::test {
namespace {

using std::numbers::pi;

/// A material that scatters this share of light equally in all directions, and nothing else.
Material matt(double albedo) {
  return {.base_color = glm::dvec3(albedo), .refractive_index = 1.0};
}

glm::dquat looking_down() {
  return glm::angleAxis(pi / 2.0, glm::dvec3(0.0, 1.0, 0.0));
}

Light uniform_sky(double luminance_cdpm2) {
  const glm::dvec3 all(luminance_cdpm2);
  return {.kind = LightKind::sky, .zenith_cdpm2 = all, .horizon_cdpm2 = all, .ground_cdpm2 = all};
}

class ImageModes : public ImageTest, public testing::WithParamInterface<ImageMode> {
 protected:
  const Image& image_of(const Camera& camera, ImageQueryOptions options) {
    options.mode = GetParam();
    return ImageTest::image_of(camera, options);
  }
};

std::string name_of_mode(const testing::TestParamInfo<ImageMode>& mode) {
  return to_string(mode.param);
}

constexpr ImageMode both_modes[] = {ImageMode::path_traced, ImageMode::real_time};

TEST_F(ImageTest, AnEmittingBoxIsAsBrightAsItsReflectionsAdd) {
  const double albedo = 0.5;
  Material material = matt(albedo);
  material.emission_cdpm2 = {100.0, 50.0, 10.0};
  create_body(add(make_box({2.0, 3.0, 4.0})), {}, material);
  for (const std::uint32_t bounces : {0u, 1u, 3u, 8u}) {
    const Image& image = image_of(
        {.p_m = {0.1f, 0.2f, 0.3f}},
        {.width = 32, .height = 32, .outputs = linear_color, .samples_per_pixel = 64, .bounces = bounces});
    const double factor = (1.0 - std::pow(albedo, bounces + 1.0)) / (1.0 - albedo);
    const glm::dvec3 expected = factor * material.emission_cdpm2;
    EXPECT_LT(glm::length(mean_color(image) - expected), 0.01 * glm::length(expected)) << bounces;
  }
}

/// A body that absorbs nothing looks like the uniform sky behind it.
TEST_P(ImageModes, AWhiteBodyInAUniformSkyIsAsBrightAsTheSky) {
  create_light(uniform_sky(1000.0));
  const GeometryId sphere = add(make_sphere(1.0, 4));
  const std::vector<Material> white = {
      matt(1.0),
      {.base_color = glm::dvec3(1.0)},
      {.base_color = glm::dvec3(1.0), .roughness = 0.3},
      {.base_color = glm::dvec3(1.0), .metallic = 1.0, .roughness = 0.0},
      {.base_color = glm::dvec3(1.0), .metallic = 1.0, .roughness = 0.4},
      {.base_color = glm::dvec3(1.0), .metallic = 1.0, .roughness = 1.0},
      {.base_color = glm::dvec3(1.0), .roughness = 0.0, .transmission = 1.0},
      {.base_color = glm::dvec3(1.0), .roughness = 0.5, .transmission = 1.0},
      {.base_color = glm::dvec3(1.0), .roughness = 0.3, .transmission = 0.5}};
  double y_m = 0.0;
  for (const Material& material : white) {
    create_body(sphere, {5.0, y_m, 0.0}, material);
    const Image& image =
        image_of({.p_m = {0.0f, static_cast<float>(y_m), 0.0f}, .horizontal_angle_rad = 0.3f},
                 {.width = 32,
                  .height = 32,
                  .outputs = linear_color,
                  .samples_per_pixel = GetParam() == ImageMode::real_time ? 1u : 64u,
                  .bounces = 64});
    const glm::dvec3 mean = mean_color(image);
    EXPECT_NEAR(mean.x, 1000.0, 10.0) << y_m;
    EXPECT_NEAR(mean.y, 1000.0, 10.0) << y_m;
    y_m += 100.0;
  }
}

/// With the sky of a day, whose light is not the same from all directions.
TEST_P(ImageModes, AClosedSphereIsDarkWithin) {
  create_light({.kind = LightKind::sky,
                .zenith_cdpm2 = glm::dvec3(3000.0),
                .horizon_cdpm2 = glm::dvec3(8000.0),
                .ground_cdpm2 = glm::dvec3(0.0)});
  create_body(add(make_sphere(3.0, 2)), {}, matt(0.8));
  const Image& image =
      image_of({.p_m = {0.5f, 0.2f, 0.1f}},
               {.width = 32, .height = 32, .outputs = linear_color, .samples_per_pixel = 1, .bounces = 2});
  EXPECT_EQ(mean_color(image), glm::dvec3(0.0));
}

/// Its light comes from one direction, to which the rounded cosine of a ray may be above 1.
TEST_P(ImageModes, NoRayMeetsASunWithoutADisc) {
  constexpr std::uint32_t suns = 64;
  const auto query = prepare(ImageQueryOptions{.name = "cameras",
                                               .capacity = suns,
                                               .width = 4,
                                               .height = 4,
                                               .mode = GetParam(),
                                               .outputs = linear_color,
                                               .samples_per_pixel = 4,
                                               .bounces = 0});
  for (std::uint32_t i = 0; i < suns; ++i) {
    const glm::dquat q =
        glm::normalize(glm::dquat(0.3 + 0.1 * i, std::sin(i), std::cos(3.0 * i), 1.0 - 0.1 * i));
    create_light({.kind = LightKind::directional, .illuminance_lx = 1e5}, {}, q);
    const glm::dquat turn = glm::angleAxis(pi, glm::dvec3(0.0, 0.0, 1.0));
    query->cameras()[i] = {.q = glm::quat(q * turn), .horizontal_angle_rad = 1e-5f};
  }
  const Outcome outcome = run(*query, suns);
  ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
  for (const Image& image : query->images())
    EXPECT_EQ(mean_color(image), glm::dvec3(0.0));
}

/// Nothing hides the sun from a convex body that is alone, whatever its size, distance and position.
TEST_F(ImageTest, AConvexBodyDoesNotShadeItself) {
  constexpr std::uint32_t bodies = 32;
  constexpr double albedo = 0.5, sun_lx = 1e4;
  Random random(11);
  const auto turn_to = [](const glm::dvec3& to) {  // turns +x
    const double yaw = std::atan2(to.y, to.x), pitch = -std::asin(std::clamp(to.z, -1.0, 1.0));
    return glm::angleAxis(yaw, glm::dvec3(0.0, 0.0, 1.0)) * glm::angleAxis(pitch, glm::dvec3(0.0, 1.0, 0.0));
  };
  const GeometryId shapes[] = {add(make_rectangle(1.0, 1.0)), add(make_box({1.0, 0.3, 0.02})),
                               add(make_sphere(0.5, 1)), add(make_sphere(0.5, 5)),
                               add(make_cylinder(0.5, 0.2, 100))};
  const MaterialId paint = add_material(matt(albedo));
  const auto query = prepare(ImageQueryOptions{.name = "cameras",
                                               .capacity = bodies,
                                               .width = 16,
                                               .height = 16,
                                               .mode = ImageMode::real_time,
                                               .outputs = {.color = true, .srgb = false, .normal = true},
                                               .samples_per_pixel = 1,
                                               .bounces = 1});
  for (std::uint32_t turn = 0; turn < 24; ++turn) {
    const glm::dvec3 to_sun = random.direction();
    std::vector<EntityId> ids = {
        create_light({.kind = LightKind::directional, .illuminance_lx = sun_lx}, {}, turn_to(-to_sun))};
    std::vector<EntityRow> rows;
    for (std::uint32_t k = 0; k < bodies; ++k) {
      constexpr double from_origin_m[] = {0.0, 100.0, 1e3, 1e4};
      const double offset_m = from_origin_m[random.below(4)];
      const double size_m = random.magnitude(std::max(0.01, 1e-4 * offset_m), 1e4);
      EntityRow row = row_of(shapes[random.below(5)], glm::dvec3(glm::vec3(offset_m * random.direction())));
      row.motion.q_world = turn_to(random.direction());
      row.scale = glm::dvec3(size_m);
      row.material = paint;
      row.mask = 1u << k;
      rows.push_back(row);
      const glm::dvec3 u = glm::normalize(to_sun + random.direction());
      const double distance_m = std::min(size_m * random.magnitude(0.8, 100.0), 5e4);
      query->cameras()[k] = {.p_m = glm::vec3(row.motion.p_world_m + distance_m * u),
                             .q = glm::quat(turn_to(-u)),
                             .horizontal_angle_rad = static_cast<float>(0.8 * size_m / distance_m),
                             .near_m = static_cast<float>(2e-2 * distance_m),
                             .mask = 1u << k};
    }
    for (const EntityId id : create(rows))
      ids.push_back(id);
    const Outcome outcome = run(*query, bodies);
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    for (std::uint32_t k = 0; k < bodies; ++k) {
      const Image& image = query->images()[k];
      std::uint32_t dark = 0;
      for (std::uint32_t pixel = 0; pixel < 256; ++pixel) {
        const double expected = albedo / pi * sun_lx * glm::dot(glm::dvec3(image.normals[pixel]), to_sun);
        if (expected > 0.02 * sun_lx && color_at(image, pixel % 16, pixel / 16).x < 0.98 * expected) ++dark;
      }
      EXPECT_EQ(dark, 0u) << "turn " << turn << ", body " << k << ", size " << rows[k].scale.x << " m at "
                          << glm::length(rows[k].motion.p_world_m) << " m";
    }
    for (const EntityId id : ids)
      remove(id, {});
  }
}

class ImageOfGround : public ImageModes {
 protected:
  void SetUp() override {
    ImageModes::SetUp();
    create_body(add(make_rectangle(50.0, 50.0)), {}, matt(albedo));
  }
  /// Luminance of the ground around a point, from 4 m above it.
  double luminance_at(double x_m, double y_m, std::uint32_t samples = 4, std::uint32_t bounces = 1) {
    const Image& image = image_of(
        {.p_m = {static_cast<float>(x_m), static_cast<float>(y_m), 4.0f},
         .q = glm::quat(looking_down()),
         .horizontal_angle_rad = 0.004f},
        {.width = 8, .height = 8, .outputs = linear_color, .samples_per_pixel = samples, .bounces = bounces});
    return mean_color(image).x;
  }
  static constexpr double albedo = 0.6;
};

TEST_P(ImageOfGround, APointLightFollowsTheInverseSquareLaw) {
  create_light({.kind = LightKind::point, .intensity_cd = 800.0}, {0.0, 0.0, 2.0});
  for (const double x_m : {0.5, 1.0, 3.0}) {
    const double distance_m = std::hypot(x_m, 2.0);
    const double expected = albedo / pi * 800.0 * 2.0 / std::pow(distance_m, 3.0);
    EXPECT_NEAR(luminance_at(x_m, 0.0), expected, 0.005 * expected) << x_m;
  }
}

/// A headlight in front of a body, which would hide a light at its origin. The body turns.
TEST_P(ImageOfGround, ALightStandsInTheFrameOfItsEntity) {
  EntityRow row = row_of(add(make_box({1.0, 1.0, 1.0})), {0.0, 0.0, 3.0});
  row.motion.q_world = glm::angleAxis(pi / 2.0, glm::dvec3(0.0, 0.0, 1.0));
  row.scale = glm::dvec3(0.5);
  row.light = add_light({.kind = LightKind::point, .p_m = {2.0, 0.0, -1.0}, .intensity_cd = 800.0});
  const EntityId lamp = create(row);
  const double expected = albedo / pi * 800.0 / 4.0;  // 2 m above (0, 2)
  EXPECT_NEAR(luminance_at(0.0, 2.0), expected, 0.005 * expected);
  remove(lamp, {});
  row.light = add_light({.kind = LightKind::point, .intensity_cd = 800.0});
  create(row);
  EXPECT_EQ(luminance_at(0.0, 2.0), 0.0);
}

TEST_P(ImageOfGround, ASpotLightEndsAtItsOuterAngle) {
  create_light(
      {.kind = LightKind::spot, .intensity_cd = 500.0, .inner_angle_rad = 0.6, .outer_angle_rad = 1.2},
      {0.0, 0.0, 3.0}, looking_down());
  for (const double angle_rad : {0.1, 0.29, 0.4, 0.5, 0.58, 0.65}) {
    const double t =
        std::clamp((std::cos(angle_rad) - std::cos(0.6)) / (std::cos(0.3) - std::cos(0.6)), 0.0, 1.0);
    const double intensity_cd = 500.0 * t * t * (3.0 - 2.0 * t);
    const double expected = albedo / pi * intensity_cd * std::pow(std::cos(angle_rad), 3.0) / 9.0;
    EXPECT_NEAR(luminance_at(3.0 * std::tan(angle_rad), 0.0), expected, 0.005 * expected + 1e-3) << angle_rad;
  }
}

TEST_P(ImageOfGround, TheSunLightsByTheCosineOfItsHeightAndCastsShadows) {
  const double elevation_rad = 0.7;
  const glm::dquat shines = glm::angleAxis(elevation_rad, glm::dvec3(0.0, 1.0, 0.0));  // toward +x and down
  create_body(add(make_box({1.0, 1.0, 1.0})), {0.0, 0.0, 3.0}, matt(0.5));
  const double expected = albedo / pi * 1e4 * std::sin(elevation_rad);
  for (const double diameter_rad : {0.0, 0.01}) {
    const EntityId sun = create_light(
        {.kind = LightKind::directional, .illuminance_lx = 1e4, .angular_diameter_rad = diameter_rad}, {},
        shines);
    EXPECT_NEAR(luminance_at(10.0, 0.0), expected, 0.01 * expected);
    EXPECT_EQ(luminance_at(3.0 / std::tan(elevation_rad), 0.0), 0.0);  // in the shadow of the box
    remove(sun, {});
  }
}

TEST_P(ImageOfGround, ALampOverTheGroundLightsByItsFormFactor) {
  const double half_m = 0.5, height_m = 2.0;
  create_body(add(make_box({2.0 * half_m, 2.0 * half_m, 1e-3})), {0.0, 0.0, height_m},
              {.base_color = glm::dvec3(0.0), .emission_cdpm2 = glm::dvec3(2000.0), .refractive_index = 1.0});
  // A corner of a rectangle above a parallel element (Howell, "A Catalog of Radiation Heat Transfer
  // Configuration Factors", B-3), four times.
  const double a = half_m / height_m;
  const double root = std::sqrt(1.0 + a * a);
  const double form_factor = 4.0 * (2.0 * a / root * std::atan(a / root)) / (2.0 * pi);
  const double expected = albedo * 2000.0 * form_factor;
  const Image& image =
      image_of({.p_m = {0.0f, 0.0f, 1.5f}, .q = glm::quat(looking_down()), .horizontal_angle_rad = 0.01f},
               {.width = 16, .height = 16, .outputs = linear_color, .samples_per_pixel = 64, .bounces = 1});
  // Real-time mode has 16 points of the lamp.
  EXPECT_NEAR(mean_color(image).x, expected, (GetParam() == ImageMode::real_time ? 0.02 : 0.01) * expected);
}

TEST_P(ImageOfGround, TheSkyIsMixedByElevation) {
  const glm::dvec3 zenith(100.0), horizon(40.0), ground(7.0);
  create_light(
      {.kind = LightKind::sky, .zenith_cdpm2 = zenith, .horizon_cdpm2 = horizon, .ground_cdpm2 = ground});
  // The mean over the hemisphere, weighted by the cosine: of sin(elevation) it is 2/3.
  const double expected = albedo * (40.0 + 60.0 * 2.0 / 3.0);
  EXPECT_NEAR(luminance_at(0.0, 0.0, 256), expected, 0.01 * expected);
  const Image& up = image_of({.p_m = {0.0f, 0.0f, 1.0f}, .horizontal_angle_rad = 0.002f},
                             {.width = 4, .height = 4, .outputs = linear_color, .samples_per_pixel = 1});
  EXPECT_NEAR(color_at(up, 0, 0).x, 40.0 + 60.0 * 0.001, 0.1);
}

/// In all modes, and with shadow maps too.
TEST_F(ImageTest, FixedLightsLightAsThoseOfEntitiesDo) {
  const Light sun{.kind = LightKind::directional, .illuminance_lx = 1e4, .angular_diameter_rad = 0.01};
  const Light sky{.kind = LightKind::sky,
                  .zenith_cdpm2 = glm::dvec3(100.0, 200.0, 400.0),
                  .horizon_cdpm2 = glm::dvec3(300.0),
                  .ground_cdpm2 = glm::dvec3(30.0)};
  const glm::dquat q_sun = glm::angleAxis(0.7, glm::dvec3(0.0, 1.0, 0.0));
  const glm::dquat q_sky = glm::angleAxis(0.2, glm::dvec3(1.0, 0.0, 0.0));
  create_body(add(make_rectangle(50.0, 50.0)), {}, matt(0.6));
  create_body(add(make_box({1.0, 1.0, 1.0})), {0.0, 0.0, 0.5}, matt(0.3));
  const Camera camera{.p_m = {-6.0f, 0.0f, 3.0f}, .q = glm::quat(glm::angleAxis(0.4, glm::dvec3(0, 1, 0)))};
  ImageQueryOptions traced{.width = 40, .height = 30, .outputs = linear_color, .bounces = 2};
  ImageQueryOptions mapped = traced;
  mapped.mode = ImageMode::real_time;
  mapped.first_hits = FirstHits::rasterised;
  mapped.shadows = Shadows::mapped;
  mapped.samples_per_pixel = 1;
  const auto color_of = [&](const ImageQueryOptions& options) {
    const Image& image = image_of(camera, options);
    return std::vector<HalfColor>(image.color.begin(), image.color.end());
  };
  EXPECT_EQ(mean_color(image_of(camera, traced)), glm::dvec3(0.0));
  std::vector<std::vector<HalfColor>> by_fixed_lights;
  for (ImageQueryOptions options : {traced, mapped}) {
    options.fixed_lights = {{sun, glm::quat(q_sun)}, {sky, glm::quat(q_sky)}};
    by_fixed_lights.push_back(color_of(options));
  }
  create_light(sun, {}, q_sun);
  create_light(sky, {}, q_sky);
  EXPECT_GT(mean_color(image_of(camera, traced)).x, 100.0);
  EXPECT_EQ(by_fixed_lights[0], color_of(traced));
  EXPECT_EQ(by_fixed_lights[1], color_of(mapped));
}

TEST_P(ImageOfGround, LightOfAnotherMaskIsNotUsed) {
  EntityRow row;
  row.light = add_light({.kind = LightKind::point, .intensity_cd = 100.0});
  row.motion.p_world_m = {0.0, 0.0, 2.0};
  row.mask = 2;
  create(row);
  const ImageQueryOptions options{.width = 4, .height = 4, .outputs = linear_color, .bounces = 1};
  const Camera camera{
      .p_m = {0.5f, 0.5f, 4.0f}, .q = glm::quat(looking_down()), .horizontal_angle_rad = 0.01f};
  EXPECT_GT(mean_color(image_of(camera, options)).x, 0.0);
  Camera masked = camera;
  masked.mask = ~2u;
  EXPECT_EQ(mean_color(image_of(masked, options)).x, 0.0);
}

TEST_P(ImageModes, ARetroReflectorIsBrighterByItsGain) {
  const GeometryId plate = add(make_box({0.1, 4.0, 4.0}));
  create_light({.kind = LightKind::point, .intensity_cd = 50.0}, {0.0, 0.01, 0.0});
  Material plain = matt(0.5);
  Material retro = plain;
  retro.retro_gain = 200.0;
  const EntityId body = create_body(plate, {5.0, 0.0, 0.0}, plain);
  const Camera camera{.horizontal_angle_rad = 0.01f};
  const ImageQueryOptions options{.width = 8, .height = 8, .outputs = linear_color, .bounces = 1};
  const double matt_luminance = mean_color(image_of(camera, options)).x;
  EXPECT_NEAR(matt_luminance, 0.5 / pi * 50.0 / (4.95 * 4.95), 0.01 * matt_luminance);
  remove(body, {});
  create_body(plate, {5.0, 0.0, 0.0}, retro);
  EXPECT_NEAR(mean_color(image_of(camera, options)).x, 200.0 * matt_luminance, 2.0 * matt_luminance);
}

TEST_P(ImageModes, ColourIsAveragedOverTheExposure) {
  const double width_m = 1.0, speed_mps = 10.0, exposure_s = 0.2;
  EntityRow row = row_of(add(make_box({0.01, width_m, 4.0})), {10.0, -0.5 * width_m, 0.0});
  row.material = add_material(
      {.base_color = glm::dvec3(0.0), .emission_cdpm2 = glm::dvec3(100.0), .refractive_index = 1.0});
  row.motion.v_world_mps = {0.0, speed_mps, 0.0};
  create(row);
  // The box is on the axis from the begin of the exposure until it has moved by its width.
  const Image& image = image_of(
      {.horizontal_angle_rad = 0.001f, .exposure = Nanoseconds(static_cast<std::int64_t>(exposure_s * 1e9))},
      {.width = 8, .height = 8, .outputs = linear_color, .samples_per_pixel = 256});
  EXPECT_NEAR(mean_color(image).x, 100.0 * width_m / speed_mps / exposure_s, 1.0);
}

TEST_P(ImageModes, WhiteIsTheLuminanceOfTheExposureValue) {
  create_light(uniform_sky(1.2 * 1024.0 * 0.5));  // half of white at the exposure value 10
  const Image& image =
      image_of({.exposure_value = 10.0f}, {.width = 4, .height = 4, .outputs = {.srgb = true}});
  const std::uint8_t half = srgb8_from_linear(0.5);
  EXPECT_EQ(half, 188);
  EXPECT_EQ(image.srgb[5], (SrgbColor{half, half, half, 255}));
}

TEST_F(ImageTest, TheSeedChangesTheNoiseAlone) {
  create_light(uniform_sky(100.0));
  create_body(add(make_sphere(1.0)), {3.0, 0.0, 0.0}, matt(0.5));
  const ImageQueryOptions options{.width = 32, .height = 32, .outputs = linear_color, .samples_per_pixel = 4};
  const auto colors = [&](std::uint32_t seed) {
    const Image& image = image_of({.seed = seed}, options);
    return std::vector(image.color.begin(), image.color.end());
  };
  EXPECT_EQ(colors(1), colors(1));
  EXPECT_NE(colors(1), colors(2));
}

INSTANTIATE_TEST_SUITE_P(Both, ImageModes, testing::ValuesIn(both_modes), name_of_mode);
INSTANTIATE_TEST_SUITE_P(Both, ImageOfGround, testing::ValuesIn(both_modes), name_of_mode);

}  // namespace
}  // namespace rtstdb::test
