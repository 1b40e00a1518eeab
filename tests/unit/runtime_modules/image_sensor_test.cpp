// The sensor of a camera: white and black, the mean and variance of its noise, and that noise follows from
// the seed, the time and the pixel.

#include "runtime/modules/camera/image_sensor.hpp"

#include <glm/gtc/packing.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace hil::modules {
namespace {

rtstdb::HalfColor grey(double luminance_cdpm2) {
  const std::uint16_t half = glm::packHalf1x16(static_cast<float>(luminance_cdpm2));
  return {half, half, half, glm::packHalf1x16(1.0f)};
}

rtstdb::SrgbColor developed(const SensorOptions& options, double luminance_cdpm2) {
  const std::vector<rtstdb::HalfColor> color{grey(luminance_cdpm2)};
  std::vector<rtstdb::SrgbColor> srgb(1);
  ImageSensor(options).develop(color, 0, srgb);
  return srgb[0];
}

TEST(ImageSensor, TheExposureValueSaysWhichLuminanceIsWhite) {
  const double white_cdpm2 = 1.2 * 64.0;  // 2^6
  EXPECT_EQ(developed({.exposure_value = 6.0}, white_cdpm2), (rtstdb::SrgbColor{255, 255, 255, 255}));
  EXPECT_EQ(developed({.exposure_value = 6.0}, 2.0 * white_cdpm2), (rtstdb::SrgbColor{255, 255, 255, 255}));
  EXPECT_EQ(developed({.exposure_value = 6.0}, 0.0), (rtstdb::SrgbColor{0, 0, 0, 255}));
  // IEC 61966-2-1: half of the light is 188, and 0.001 lies on the linear part: 12.92 * 0.001 * 255 = 3.29.
  EXPECT_EQ(developed({.exposure_value = 6.0}, 0.5 * white_cdpm2)[0], 188);
  EXPECT_EQ(developed({.exposure_value = 7.0}, white_cdpm2)[0], 188);
  EXPECT_EQ(developed({.exposure_value = 6.0}, 0.001 * white_cdpm2)[0], 3);
}

struct Moments {
  double mean = 0.0, variance = 0.0;
};

Moments moments_of(const ImageSensor& sensor, double luminance_cdpm2, std::size_t channel) {
  constexpr std::uint64_t samples = 200'000;
  double sum = 0.0, squares = 0.0;
  for (std::uint64_t pixel = 0; pixel < samples; ++pixel) {
    const double share = sensor.read(grey(luminance_cdpm2), 40'000'000, pixel)[channel];
    sum += share;
    squares += share * share;
  }
  const double mean = sum / samples;
  return {mean, squares / samples - mean * mean};
}

TEST(ImageSensor, NoiseHasTheMeanAndVarianceOfItsElectrons) {
  constexpr double full_well = 2000.0, read_noise = 15.0;
  const ImageSensor sensor(
      {.exposure_value = 0.0, .full_well_e = full_well, .read_noise_e = read_noise, .noise_seed = 7});
  for (const double share : {0.0, 0.125, 0.5, 1.0, 4.0}) {
    const double exact = static_cast<double>(glm::unpackHalf1x16(grey(1.2 * share)[0])) / 1.2;
    const double variance = exact / full_well + read_noise * read_noise / (full_well * full_well);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const Moments found = moments_of(sensor, 1.2 * share, channel);
      // Five standard deviations of the estimates from 200,000 samples.
      EXPECT_NEAR(found.mean, exact, 5.0 * std::sqrt(variance / 2e5)) << share;
      EXPECT_NEAR(found.variance, variance, 5.0 * variance * std::sqrt(2.0 / 2e5)) << share;
    }
  }
}

TEST(ImageSensor, ChannelsAndPixelsAreIndependent) {
  const ImageSensor sensor({.exposure_value = 0.0, .full_well_e = 100.0, .noise_seed = 3});
  double channels = 0.0, pixels = 0.0, last = 0.0;
  constexpr std::uint64_t samples = 100'000;
  for (std::uint64_t pixel = 0; pixel < samples; ++pixel) {
    const auto share = sensor.read(grey(0.6), 0, pixel);
    const double red = share[0] - 0.5, blue = share[2] - 0.5;
    channels += red * blue;
    pixels += red * last;
    last = red;
  }
  const double variance = 0.5 / 100.0;
  EXPECT_NEAR(channels / samples, 0.0, 5.0 * variance / std::sqrt(1e5));
  EXPECT_NEAR(pixels / samples, 0.0, 5.0 * variance / std::sqrt(1e5));
}

TEST(ImageSensor, NoiseFollowsFromSeedTimeAndPixel) {
  const SensorOptions options{.exposure_value = 0.0, .full_well_e = 1000.0, .noise_seed = 1};
  const ImageSensor sensor(options);
  const auto share = sensor.read(grey(0.6), 5, 9);
  EXPECT_EQ(share, ImageSensor(options).read(grey(0.6), 5, 9));
  EXPECT_NE(share, sensor.read(grey(0.6), 6, 9));
  EXPECT_NE(share, sensor.read(grey(0.6), 5, 10));
  SensorOptions other = options;
  other.noise_seed = 2;
  EXPECT_NE(share, ImageSensor(other).read(grey(0.6), 5, 9));
}

}  // namespace
}  // namespace hil::modules
