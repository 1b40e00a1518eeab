#include "runtime/run/image_files.hpp"

#include <png.h>

#include <cstring>
#include <system_error>

#include "runtime/config/require.hpp"

namespace hil::run {
namespace {

/// Why the image could not be written; empty: it is complete.
std::string write_png(const contribution::Image& image, const std::filesystem::path& file) {
  config::require(
      image.width > 0 && image.height > 0 && image.grey.size() == std::size_t{image.width} * image.height,
      "an image has width * height pixels");
  png_image png;
  std::memset(&png, 0, sizeof png);
  png.version = PNG_IMAGE_VERSION;
  png.width = image.width;
  png.height = image.height;
  png.format = PNG_FORMAT_GRAY;
  const bool written = png_image_write_to_file(&png, file.c_str(), 0, image.grey.data(), 0, nullptr) != 0;
  return written ? std::string() : file.string() + " can not be written: " + png.message;
}

}  // namespace

std::filesystem::path image_folder(const std::filesystem::path& run_folder) {
  return run_folder / "images";
}

std::vector<std::string> write_images(std::span<const contribution::Image> images,
                                      const std::filesystem::path& folder) {
  std::vector<std::string> faults;
  if (images.empty()) return faults;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return {"folder " + folder.string() + " can not be created: " + error.message()};
  for (const contribution::Image& image : images) {
    if (std::string fault = write_png(image, folder / (image.name + ".png")); !fault.empty())
      faults.push_back(std::move(fault));
  }
  return faults;
}

}  // namespace hil::run
