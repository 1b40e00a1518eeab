#include "tests/support/png_reader.hpp"

#include <png.h>

#include <cstdio>
#include <memory>
#include <stdexcept>

namespace hil::tests {

PngContent read_png(const std::filesystem::path& file) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> input(std::fopen(file.c_str(), "rb"), std::fclose);
  if (!input) return {};
  const auto fail = [](png_structp, png_const_charp message) { throw std::runtime_error(message); };
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, nullptr);
  png_infop info = png_create_info_struct(png);
  PngContent content;
  try {
    png_init_io(png, input.get());
    png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
    content.width = png_get_image_width(png, info);
    content.height = png_get_image_height(png, info);
    content.bits = png_get_bit_depth(png, info);
    content.channels = png_get_channels(png, info);
    const png_bytepp rows = png_get_rows(png, info);
    const std::size_t in_row = std::size_t{content.width} * static_cast<std::size_t>(content.channels);
    for (std::uint32_t y = 0; y < content.height; ++y) {
      for (std::size_t i = 0; i < in_row; ++i)
        content.samples.push_back(content.bits == 16
                                      ? static_cast<std::uint16_t>(rows[y][2 * i] << 8 | rows[y][2 * i + 1])
                                      : rows[y][i]);
    }
  } catch (const std::runtime_error&) {
    content = {};
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return content;
}

}  // namespace hil::tests
