// The receiver of a laser scanner against closed forms: intensities, the threshold, and the noise of ranges.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include <hil/noise_seed.hpp>
#include <hil/world/receiver.hpp>

namespace hil::modules {
namespace {

const glm::dvec3 forward{1.0, 0.0, 0.0};

BeamReturn plate(float range_m, float cosine, float fraction = 1.0f) {
  BeamReturn beam_return{.fraction = fraction};
  beam_return.hit.status = rtstdb::HitStatus::hit;
  beam_return.hit.lambda = range_m;
  beam_return.hit.n_world = {-cosine, std::sqrt(1.0f - cosine * cosine), 0.0f};
  return beam_return;
}

TEST(Receiver, IntensityIsReflectanceTimesFractionTimesCosineOverSquaredRange) {
  const rtstdb::Material paint{.reflectance = 0.4};
  EXPECT_DOUBLE_EQ(intensity_per_m2(paint, 1.0, 1.0, 10.0), 0.4 / 100.0);
  EXPECT_DOUBLE_EQ(intensity_per_m2(paint, 0.5, 1.0, 10.0), 0.2 / 100.0);
  EXPECT_DOUBLE_EQ(intensity_per_m2(paint, 1.0, 0.25, 20.0), 0.1 / 400.0);
  EXPECT_DOUBLE_EQ(intensity_per_m2({}, 1.0, 1.0, 0.0), 1e6) << "ranges below 1 mm count as 1 mm";
}

TEST(Receiver, RetroReflectorHasItsGainInPlaceOfTheCosine) {
  const rtstdb::Material foil{.reflectance = 0.9, .retro_gain = 300.0};
  EXPECT_DOUBLE_EQ(intensity_per_m2(foil, 0.01, 1.0, 100.0), 0.9 * 300.0 * 0.01 / 1e4);
  EXPECT_DOUBLE_EQ(intensity_per_m2(foil, 0.01, 0.1, 100.0), 0.9 * 300.0 * 0.01 / 1e4);
}

TEST(Receiver, CosineIsThatOfEitherSide) {
  const Receiver receiver;
  const auto front = receiver.detect(plate(10.0f, 0.5f), {}, forward, {});
  const auto back = receiver.detect(plate(10.0f, 0.5f), {}, -forward, {});
  ASSERT_TRUE(front && back);
  EXPECT_NEAR(front->intensity_per_m2, 0.005, 1e-9);
  EXPECT_DOUBLE_EQ(front->intensity_per_m2, back->intensity_per_m2);
  EXPECT_EQ(front->range_m, 10.0);
}

/// The length of a normal in single precision may exceed one.
TEST(Receiver, CosineIsAtMostOne) {
  BeamReturn beam_return = plate(10.0f, 1.0f);
  beam_return.hit.n_world.x = -std::nextafter(1.0f, 2.0f);
  const auto detection = Receiver().detect(beam_return, {}, forward, {});
  ASSERT_TRUE(detection);
  EXPECT_EQ(detection->intensity_per_m2, intensity_per_m2({}, 1.0, 1.0, 10.0));
}

TEST(Receiver, ReturnsAtAndBelowTheThresholdAreNotDetected) {
  const double intensity = intensity_per_m2({}, 1.0, 1.0, 10.0);
  EXPECT_FALSE(Receiver({.threshold_per_m2 = intensity}).detect(plate(10.0f, 1.0f), {}, forward, {}));
  const double below = std::nextafter(intensity, 0.0);
  EXPECT_TRUE(Receiver({.threshold_per_m2 = below}).detect(plate(10.0f, 1.0f), {}, forward, {}));
  EXPECT_FALSE(Receiver({.threshold_per_m2 = below}).detect(plate(10.1f, 1.0f), {}, forward, {}));
  EXPECT_FALSE(Receiver().detect(plate(10.0f, 1.0f), {.reflectance = 0.0}, forward, {})) << "black";
  EXPECT_FALSE(Receiver().detect({}, {}, forward, {})) << "a miss";
  BeamReturn incomplete = plate(10.0f, 1.0f);
  incomplete.hit.status = rtstdb::HitStatus::incomplete;
  EXPECT_FALSE(Receiver().detect(incomplete, {}, forward, {}));
}

std::vector<double> errors_m(const Receiver& receiver, std::size_t count) {
  std::vector<double> errors;
  for (std::size_t k = 0; k < count; ++k) {
    const ReturnNumber number{static_cast<std::int64_t>(k / 1000) * 100'000'000, k % 1000 / 2,
                              static_cast<std::uint32_t>(k % 2)};
    errors.push_back(receiver.detect(plate(50.0f, 1.0f), {}, forward, number)->range_m - 50.0);
  }
  return errors;
}

TEST(Receiver, RangeNoiseIsNormalWithItsDeviation) {
  constexpr std::size_t count = 100'000;
  constexpr double deviation_m = 0.02;
  const Receiver receiver({.range_noise_m = deviation_m, .noise_seed = noise_seed(1, "lidar")});
  const std::vector<double> errors = errors_m(receiver, count);
  double mean = 0.0, square = 0.0, fourth = 0.0, neighbours = 0.0;
  std::size_t beyond_two = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double z = errors[k] / deviation_m;
    mean += z / count;
    square += z * z / count;
    fourth += z * z * z * z / count;
    if (k > 0) neighbours += z * errors[k - 1] / deviation_m / count;
    beyond_two += std::abs(z) > 2.0 ? 1 : 0;
  }
  // Five standard deviations of each estimate.
  EXPECT_NEAR(mean, 0.0, 5.0 * std::sqrt(1.0 / count));
  EXPECT_NEAR(square, 1.0, 5.0 * std::sqrt(2.0 / count));
  EXPECT_NEAR(fourth, 3.0, 5.0 * std::sqrt(96.0 / count));
  EXPECT_NEAR(neighbours, 0.0, 5.0 * std::sqrt(1.0 / count));
  EXPECT_NEAR(static_cast<double>(beyond_two) / count, 0.0455, 5.0 * std::sqrt(0.0455 / count));
}

TEST(Receiver, NoiseIsAFunctionOfSeedModuleAndNumber) {
  const auto with = [](std::int64_t seed) {
    return errors_m(Receiver({.range_noise_m = 0.02, .noise_seed = seed}), 100);
  };
  EXPECT_EQ(with(noise_seed(1, "lidar")), with(noise_seed(1, "lidar")));
  EXPECT_NE(with(noise_seed(1, "lidar")), with(noise_seed(2, "lidar")));
  EXPECT_NE(with(noise_seed(1, "lidar")), with(noise_seed(1, "rear")));
  for (std::uint64_t run = 0; run < 1000; ++run)
    EXPECT_GE(noise_seed(run, "lidar"), 0);
}

TEST(Receiver, MeasuredRangeIsNotNegative) {
  const Receiver receiver({.range_noise_m = 10.0, .noise_seed = 3});
  std::size_t at_zero = 0;
  for (std::uint64_t beam = 0; beam < 1000; ++beam) {
    const double range_m = receiver.detect(plate(1.0f, 1.0f), {}, forward, {0, beam, 0})->range_m;
    ASSERT_GE(range_m, 0.0);
    at_zero += range_m == 0.0 ? 1 : 0;
  }
  EXPECT_GT(at_zero, 300u);
}

}  // namespace
}  // namespace hil::modules
