#pragma once
// The samples of an image that the run writes as a PNG file. Threads: plain data.

#include <cstdint>
#include <span>
#include <variant>

namespace hil::modules {

/// Row by row from the top left: width * height times the samples of a pixel.
struct PngImage {
  struct Grey8 {
    std::span<const std::uint8_t> samples;
  };
  struct Grey16 {
    std::span<const std::uint16_t> samples;  ///< any quantity; the file says that they are linear
  };
  struct Rgb8 {
    std::span<const std::uint8_t> samples;  ///< sRGB: red, green, blue
  };
  std::uint32_t width = 0, height = 0;  ///< above 0
  std::variant<Grey8, Grey16, Rgb8> pixels;
};

}  // namespace hil::modules
