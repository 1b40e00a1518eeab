#include "runtime/run/image_files.hpp"

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>

#include "runtime/run/png_file.hpp"

namespace hil::run {

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
    const PngImage png{.width = image.width, .height = image.height, .pixels = PngImage::Grey8{image.grey}};
    if (std::string fault = write_png(png, folder / (image.name + ".png")); !fault.empty())
      faults.push_back(std::move(fault));
  }
  return faults;
}

std::vector<std::uint16_t> depth_samples(std::span<const float> depth_m, double step_m) {
  std::vector<std::uint16_t> samples(depth_m.size());
  std::ranges::transform(depth_m, samples.begin(), [&](float depth) {
    if (!std::isfinite(depth)) return std::uint16_t{0};
    const double units = std::round(static_cast<double>(depth) / step_m);
    return static_cast<std::uint16_t>(std::clamp(units, 1.0, 65535.0));
  });
  return samples;
}

}  // namespace hil::run
