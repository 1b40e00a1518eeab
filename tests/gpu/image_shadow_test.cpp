// Shadow maps against shadow rays: pixels that are two texels off an edge of a shadow are equally bright.

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/gpu/image_fixture.hpp"

namespace rtstdb::test {
namespace {

glm::dquat turned(double yaw_rad, double pitch_rad) {
  return glm::angleAxis(yaw_rad, glm::dvec3(0.0, 0.0, 1.0)) *
         glm::angleAxis(pitch_rad, glm::dvec3(0.0, 1.0, 0.0));
}

class ImageShadows : public ImageTest {
 protected:
  static constexpr std::uint32_t columns = 96, rows = 72;

  void SetUp() override {
    ImageTest::SetUp();
    if (!database().device().draws) GTEST_FAIL() << "the device can not draw";
    create_body(add(make_rectangle(60.0, 60.0)), {}, paint);
    create_body(add(make_box({2.0, 1.0, 3.0})), {4.0, 1.0, 1.5}, paint);
    create_body(add(make_box({1.0, 6.0, 0.5})), {7.0, -2.0, 2.0}, paint);
    create_body(add(make_sphere(0.8, 4)), {5.0, -1.5, 1.0}, paint);
    EntityRow moving = row_of(add(make_box({0.5, 0.5, 0.5})), {5.0, 0.0, 3.5});
    moving.material = add_material(paint);
    moving.motion.v_world_mps = {0.0, 4.0, 0.0};
    create(moving);
  }
  static ImageQueryOptions options_with(Shadows shadows, std::uint32_t map_side) {
    return {.name = "camera",
            .width = columns,
            .height = rows,
            .mode = ImageMode::real_time,
            .outputs = linear_color,
            .first_hits = FirstHits::rasterised,
            .samples_per_pixel = 1,
            .bounces = 1,
            .shadows = shadows,
            .shadow_map_side = map_side};
  }
  std::vector<HalfColor> colors_of(const ImageQueryOptions& options) {
    const Image& image = image_of(camera, options);
    return {image.color.begin(), image.color.end()};
  }
  std::vector<glm::dvec3> colors_with(Shadows shadows) {
    const Image& image = image_of(camera, options_with(shadows, 2048));
    std::vector<glm::dvec3> colors;
    for (std::uint32_t row = 0; row < rows; ++row)
      for (std::uint32_t column = 0; column < columns; ++column)
        colors.push_back(color_at(image, column, row));
    return colors;
  }
  /// Pixels beside which brightness changes by more than a third are near an edge.
  static bool is_off_edges(const std::vector<glm::dvec3>& colors, std::uint32_t column, std::uint32_t row) {
    double least = 1e9, greatest = 0.0;
    for (std::uint32_t y = row - 2; y <= row + 2; ++y) {
      for (std::uint32_t x = column - 2; x <= column + 2; ++x) {
        least = std::min(least, colors[y * columns + x].x);
        greatest = std::max(greatest, colors[y * columns + x].x);
      }
    }
    return greatest < 1.5 * least || greatest == 0.0;
  }
  void expect_equal_shadows() {
    const auto traced = colors_with(Shadows::traced);
    const auto mapped = colors_with(Shadows::mapped);
    std::size_t compared = 0, equal = 0, dark = 0, lit = 0;
    for (std::uint32_t row = 2; row + 2 < rows; ++row) {
      for (std::uint32_t column = 2; column + 2 < columns; ++column) {
        if (!is_off_edges(traced, column, row)) continue;
        const double expected = traced[row * columns + column].x;
        ++compared;
        equal += std::abs(mapped[row * columns + column].x - expected) <= 1e-3 * expected ? 1 : 0;
        dark += expected == 0.0 ? 1 : 0;
        lit += expected > 0.0 ? 1 : 0;
      }
    }
    EXPECT_GT(compared, columns * rows / 2);
    EXPECT_GT(dark, 60u) << "the test needs shadows";
    EXPECT_GT(lit, 60u);
    EXPECT_GE(static_cast<double>(equal), 0.995 * static_cast<double>(compared)) << compared - equal;
  }
  Material paint{.base_color = glm::dvec3(0.6), .refractive_index = 1.0};
  /// Looks down at the bodies, late enough that the moving one has moved.
  Camera camera{.p_m = {-1.0f, 0.5f, 4.0f},
                .q = glm::quat(turned(0.0, 0.5)),
                .horizontal_angle_rad = 1.2f,
                .t = WorldTime(Nanoseconds(300'000'000))};
};

TEST_F(ImageShadows, OfTheSunEqualThoseOfRays) {
  create_light({.kind = LightKind::directional, .illuminance_lx = 1e4}, {}, turned(0.7, 0.6));
  expect_equal_shadows();
}

/// What is far away, and what is behind the camera and throws its shadow before it.
TEST_F(ImageShadows, OfTheSunDoNotDependOnFarSurfaces) {
  create_light({.kind = LightKind::directional, .illuminance_lx = 1e4}, {}, turned(0.7, 0.6));
  create_body(add(make_sphere(3000.0, 5)), {20000.0, 0.0, 500.0}, paint);
  create_body(add(make_box({1.0, 3.0, 300.0})), {-15.0, -9.0, 150.0}, paint);
  expect_equal_shadows();
}

TEST_F(ImageShadows, OfASpotEqualThoseOfRays) {
  create_light({.kind = LightKind::spot, .intensity_cd = 5e3, .inner_angle_rad = 0.8, .outer_angle_rad = 1.4},
               {0.0, 4.0, 6.0}, turned(-0.7, 0.7));
  expect_equal_shadows();
}

TEST_F(ImageShadows, OfAWideSpotEqualThoseOfRays) {
  create_light({.kind = LightKind::spot, .intensity_cd = 5e3, .inner_angle_rad = 2.0, .outer_angle_rad = 3.0},
               {0.0, 4.0, 6.0}, turned(-0.7, 0.7));
  expect_equal_shadows();
}

/// Between the bodies, so that all faces of the cube are used.
TEST_F(ImageShadows, OfAPointLightEqualThoseOfRays) {
  create_light({.kind = LightKind::point, .intensity_cd = 2e3}, {5.5, -0.2, 2.2});
  expect_equal_shadows();
}

/// With three maps a sun has none.
TEST_F(ImageShadows, AreTracedWhereMapsAreTooFew) {
  create_light({.kind = LightKind::directional, .illuminance_lx = 1e4}, {}, turned(0.7, 0.6));
  create_light({.kind = LightKind::point, .intensity_cd = 2e3}, {5.5, -0.2, 2.2});
  const auto traced = colors_of(options_with(Shadows::traced, 64));
  const auto mapped = [&](std::uint32_t maps) {
    ImageQueryOptions options = options_with(Shadows::mapped, 64);
    options.shadow_maps = maps;
    return colors_of(options);
  };
  EXPECT_EQ(mapped(3), traced);
  EXPECT_NE(mapped(9), traced);
  EXPECT_NE(mapped(10), mapped(9));
}

/// Also where no output comes from the ray through the middle of a pixel.
TEST_F(ImageShadows, AreMappedWithSeveralSamples) {
  create_light({.kind = LightKind::directional, .illuminance_lx = 1e4}, {}, turned(0.7, 0.6));
  ImageQueryOptions options = options_with(Shadows::mapped, 64);
  options.samples_per_pixel = 2;
  const auto mapped = colors_of(options);
  options.shadows = Shadows::traced;
  EXPECT_NE(mapped, colors_of(options)) << "the texels are large";
}

/// Each image of a batch has maps of its own.
TEST_F(ImageShadows, OfSeveralImagesAreThoseOfEach) {
  create_light({.kind = LightKind::directional, .illuminance_lx = 1e4}, {}, turned(0.7, 0.6));
  ImageQueryOptions options = options_with(Shadows::mapped, 256);
  options.capacity = 3;
  options.bounces = 2;
  const auto query = prepare(options);
  std::vector<Camera> cameras(3, camera);
  cameras[1].p_m.y = 8.0f;
  cameras[2].t += Nanoseconds(400'000'000);
  std::ranges::copy(cameras, query->cameras().begin());
  ASSERT_TRUE(run(*query, 3).done());
  options.capacity = 1;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Image& alone = image_of(cameras[i], options);
    EXPECT_TRUE(std::ranges::equal(query->images()[i].color, alone.color)) << i;
  }
}

TEST_F(ImageTest, WithoutARasteriserShadowsAreTraced) {
  gpu::DeviceOptions device;
  device.draws = false;
  open({}, device);
  create_light({.kind = LightKind::directional, .illuminance_lx = 1e4}, {}, turned(0.7, 0.6));
  create_body(add(make_rectangle(60.0, 60.0)), {}, {.base_color = glm::dvec3(0.6)});
  create_body(add(make_box({2.0, 1.0, 3.0})), {4.0, 1.0, 1.5}, {.base_color = glm::dvec3(0.6)});
  ImageQueryOptions options{.width = 32,
                            .height = 24,
                            .mode = ImageMode::real_time,
                            .outputs = linear_color,
                            .first_hits = FirstHits::rasterised,
                            .samples_per_pixel = 1,
                            .bounces = 1,
                            .shadows = Shadows::mapped,
                            .shadow_map_side = 64};
  const Camera camera{.p_m = {-1.0f, 0.5f, 4.0f}, .q = glm::quat(turned(0.0, 0.5))};
  const Image& mapped = image_of(camera, options);
  const std::vector colors(mapped.color.begin(), mapped.color.end());
  options.shadows = Shadows::traced;
  EXPECT_TRUE(std::ranges::equal(image_of(camera, options).color, colors));
}

}  // namespace
}  // namespace rtstdb::test
