#include "runtime/run/report_image.hpp"

#include <algorithm>
#include <array>

#include <rtstdb/srgb.hpp>

#include "runtime/run/base64.hpp"
#include "runtime/run/png_file.hpp"

namespace hil::run {

SmallImage reduced(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb,
                   std::uint64_t max_pixels) {
  const auto count_at = [](std::uint32_t side, std::uint32_t factor) { return (side + factor - 1) / factor; };
  std::uint32_t factor = 1;
  while (std::uint64_t{count_at(width, factor)} * count_at(height, factor) > max_pixels)
    ++factor;
  if (factor == 1) return {width, height, {rgb.begin(), rgb.end()}};
  std::array<double, 256> linear{};
  for (std::size_t i = 0; i < linear.size(); ++i)
    linear[i] = rtstdb::linear_from_srgb(static_cast<double>(i) / 255.0);
  SmallImage small{count_at(width, factor), count_at(height, factor), {}};
  small.rgb.reserve(std::size_t{3} * small.width * small.height);
  for (std::uint32_t y = 0; y < height; y += factor) {
    for (std::uint32_t x = 0; x < width; x += factor) {
      const std::uint32_t end_x = std::min(x + factor, width), end_y = std::min(y + factor, height);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        double sum = 0.0;
        for (std::uint32_t row = y; row < end_y; ++row)
          for (std::uint32_t column = x; column < end_x; ++column)
            sum += linear[rgb[3 * (std::size_t{row} * width + column) + channel]];
        small.rgb.push_back(rtstdb::srgb8_from_linear(sum / ((end_x - x) * (end_y - y))));
      }
    }
  }
  return small;
}

std::string report_png(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb) {
  const SmallImage small = reduced(width, height, rgb, max_report_pixels);
  return base64(
      png_bytes({.width = small.width, .height = small.height, .pixels = PngImage::Rgb8{small.rgb}}));
}

}  // namespace hil::run
