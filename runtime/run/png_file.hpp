#pragma once
// PNG files (libpng).
//
// Threads: any; writes files and allocates.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>

namespace hil::run {

/// The samples of an image, row by row from the top left: width * height times those of a pixel.
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

/// Why the file could not be written, as a sentence that names it; empty: it is complete.
std::string write_png(const PngImage& image, const std::filesystem::path& file);

/// The bytes of such a file. Throws std::bad_alloc.
std::string png_bytes(const PngImage& image);

}  // namespace hil::run
