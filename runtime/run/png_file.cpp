#include "runtime/run/png_file.hpp"

#include <png.h>

#include <cstring>
#include <new>

#include <hil/require.hpp>

namespace hil::run {
namespace {

struct Source {
  png_image header;
  const void* samples;
};

Source source_of(const PngImage& image) {
  Source source{};
  std::memset(&source.header, 0, sizeof source.header);
  source.header.version = PNG_IMAGE_VERSION;
  source.header.width = image.width;
  source.header.height = image.height;
  std::size_t per_pixel = 1, samples = 0;
  if (const auto* const grey = std::get_if<PngImage::Grey8>(&image.pixels)) {
    source.header.format = PNG_FORMAT_GRAY;
    source.samples = grey->samples.data();
    samples = grey->samples.size();
  } else if (const auto* const deep = std::get_if<PngImage::Grey16>(&image.pixels)) {
    source.header.format = PNG_FORMAT_LINEAR_Y;
    source.samples = deep->samples.data();
    samples = deep->samples.size();
  } else {
    const auto& rgb = std::get<PngImage::Rgb8>(image.pixels);
    source.header.format = PNG_FORMAT_RGB;
    source.samples = rgb.samples.data();
    samples = rgb.samples.size();
    per_pixel = 3;
  }
  config::require(image.width > 0 && image.height > 0 && samples == per_pixel * image.width * image.height,
                  "an image has width * height pixels");
  return source;
}

}  // namespace

std::string write_png(const PngImage& image, const std::filesystem::path& file) {
  Source source = source_of(image);
  if (png_image_write_to_file(&source.header, file.c_str(), 0, source.samples, 0, nullptr) != 0) return {};
  return file.string() + " can not be written: " + source.header.message;
}

std::string png_bytes(const PngImage& image) {
  Source source = source_of(image);
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(source.header), '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&source.header, bytes.data(), &size, 0, source.samples, 0, nullptr) == 0)
    throw std::bad_alloc();
  bytes.resize(size);
  return bytes;
}

}  // namespace hil::run
