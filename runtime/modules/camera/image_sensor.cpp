#include "runtime/modules/camera/image_sensor.hpp"

#include <glm/gtc/packing.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <hil/splitmix64.hpp>
#include <rtstdb/srgb.hpp>

namespace hil::modules {
namespace {

/// Uniform in (0, 1].
double open_uniform(std::uint64_t word) noexcept {
  return (static_cast<double>(word >> 11) + 1.0) * 0x1p-53;
}

/// Four independent numbers of the standard normal distribution (Box, Muller, 1958).
std::array<double, 4> four_normals(std::uint64_t state) noexcept {
  std::array<double, 4> normals{};
  for (std::size_t pair = 0; pair < 2; ++pair) {
    const double radius = std::sqrt(-2.0 * std::log(open_uniform(splitmix64(state))));
    state += splitmix64_step;
    const double angle = 2.0 * std::numbers::pi * open_uniform(splitmix64(state));
    state += splitmix64_step;
    normals[2 * pair] = radius * std::cos(angle);
    normals[2 * pair + 1] = radius * std::sin(angle);
  }
  return normals;
}

}  // namespace

ImageSensor::ImageSensor(const SensorOptions& options) noexcept
    : options_(options), share_per_cdpm2_(1.0 / rtstdb::white_cdpm2(options.exposure_value)) {}

std::array<double, 3> ImageSensor::read(const rtstdb::HalfColor& color, std::int64_t time_ns,
                                        std::uint64_t pixel) const noexcept {
  std::array<double, 3> shares{};
  for (std::size_t channel = 0; channel < shares.size(); ++channel)
    shares[channel] = static_cast<double>(glm::unpackHalf1x16(color[channel])) * share_per_cdpm2_;
  if (!has_noise()) return shares;
  std::uint64_t state = splitmix64(options_.noise_seed);
  state = splitmix64_finalizer(state ^ (static_cast<std::uint64_t>(time_ns) + splitmix64_step));
  state = splitmix64_finalizer(state ^ (pixel + splitmix64_step));
  const std::array<double, 4> normals = four_normals(state);
  const double read_share = options_.read_noise_e / options_.full_well_e;
  for (std::size_t channel = 0; channel < shares.size(); ++channel) {
    const double variance = std::max(shares[channel], 0.0) / options_.full_well_e + read_share * read_share;
    shares[channel] += std::sqrt(variance) * normals[channel];
  }
  return shares;
}

void ImageSensor::develop(std::span<const rtstdb::HalfColor> color, std::int64_t time_ns,
                          std::span<rtstdb::SrgbColor> srgb) const noexcept {
  for (std::size_t pixel = 0; pixel < color.size(); ++pixel) {
    const std::array<double, 3> shares = read(color[pixel], time_ns, pixel);
    srgb[pixel] = {rtstdb::srgb8_from_linear(shares[0]), rtstdb::srgb8_from_linear(shares[1]),
                   rtstdb::srgb8_from_linear(shares[2]), 255};
  }
}

}  // namespace hil::modules
