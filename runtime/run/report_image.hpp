#pragma once
// Images as report.json and report.html hold them: small PNG files in base64.
//
// Threads: pure functions. They allocate.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hil::run {

/// Of an image in the report, at most.
inline constexpr std::uint64_t max_report_pixels = 640 * 480;

struct SmallImage {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb{};  ///< sRGB
};

/// Squares of pixels become one, with the mean of their linear values, so that at most `max_pixels` remain.
SmallImage reduced(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb,
                   std::uint64_t max_pixels);

/// A PNG file in base64, of at most max_report_pixels. `rgb`: sRGB, width * height * 3.
std::string report_png(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb);

}  // namespace hil::run
