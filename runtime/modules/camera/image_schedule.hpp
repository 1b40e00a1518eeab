#pragma once
// Which releases of a task take an image: all, or those nearest to the multiples of an image's period.
//
// Threads: immutable.

#include <cmath>
#include <cstdint>
#include <optional>

namespace hil::modules {

class ImageSchedule {
 public:
  /// `images_hz`: 0 for an image in each release; else at most the task's rate.
  ImageSchedule(double images_hz, std::int64_t period_ns) noexcept
      : releases_per_image_(images_hz > 0.0 ? 1e9 / (images_hz * static_cast<double>(period_ns)) : 1.0) {}

  /// The number of the image that release number `release` takes, both from 0. Image k belongs to the release
  /// that is nearest to k times the period of an image.
  std::optional<std::uint64_t> image_of(std::uint64_t release) const noexcept {
    const auto below =
        static_cast<std::uint64_t>(std::floor(static_cast<double>(release) / releases_per_image_));
    for (std::uint64_t image = below; image <= below + 1; ++image)
      if (release_of(image) == release) return image;
    return std::nullopt;
  }
  double releases_per_image() const noexcept { return releases_per_image_; }
  /// Whether the images are equally spaced. Rates are decimal numbers, which may be rounded.
  bool is_even() const noexcept {
    constexpr double tolerance = 1e-9;
    return std::abs(releases_per_image_ - std::round(releases_per_image_)) <= tolerance * releases_per_image_;
  }

 private:
  std::uint64_t release_of(std::uint64_t image) const noexcept {
    const double releases = is_even() ? std::round(releases_per_image_) : releases_per_image_;
    return static_cast<std::uint64_t>(std::llround(static_cast<double>(image) * releases));
  }

  double releases_per_image_;
};

}  // namespace hil::modules
