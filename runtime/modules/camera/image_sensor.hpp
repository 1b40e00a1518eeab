#pragma once
// The sensor of a camera: makes sRGB pixels of linear ones, with noise.
//
// A channel of luminance L fills the share x = L / (1.2 * 2^exposure_value) of a pixel's full well
// (ISO 12232, saturation-based speed). With noise, the share that is read is normally distributed with the
// mean x and the variance
//     x / full_well_e + (read_noise_e / full_well_e)^2
// which is that of the number of electrons (shot noise, Poisson's for many electrons) and of its reading. The
// share is cut to [0, 1] and encoded as sRGB (IEC 61966-2-1). The noise depends on the seed, the time, the
// pixel and the channel alone.
//
// Threads: immutable.

#include <array>
#include <cstdint>
#include <span>

#include <rtstdb/image.hpp>

namespace hil::modules {

struct SensorOptions {
  double exposure_value = 12.0;  ///< at ISO 100
  double full_well_e = 0.0;      ///< electrons of a channel that is white; 0: no noise
  double read_noise_e = 0.0;     ///< standard deviation of reading a channel, in electrons
  std::uint64_t noise_seed = 0;
};

class ImageSensor {
 public:
  explicit ImageSensor(const SensorOptions& options) noexcept;

  bool has_noise() const noexcept { return options_.full_well_e > 0.0; }

  /// The shares of a full well that the three channels of a pixel are read as, before they are cut to [0, 1].
  /// `pixel`: row * width + column.
  std::array<double, 3> read(const rtstdb::HalfColor& color, std::int64_t time_ns,
                             std::uint64_t pixel) const noexcept;
  /// The sRGB pixels of the image that was exposed from time_ns on. Both spans have one length.
  void develop(std::span<const rtstdb::HalfColor> color, std::int64_t time_ns,
               std::span<rtstdb::SrgbColor> srgb) const noexcept;

 private:
  SensorOptions options_;
  double share_per_cdpm2_;
};

}  // namespace hil::modules
