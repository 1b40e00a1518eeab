#include "runtime/modules/camera/image_encoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace hil::modules {

ImageEncoder::ImageEncoder(const ImageEncoderOptions& options)
    : options_(options),
      sensor_(options.sensor),
      pixels_(std::size_t{options.width} * options.height),
      developed_(options.has_images && sensor_.has_noise() ? pixels_ : 0),
      rgb_(options.has_images ? 3 * pixels_ : 0) {}

std::size_t ImageEncoder::buffer_bytes() const noexcept {
  const std::size_t color = sensor_.has_noise() ? sizeof(rtstdb::HalfColor) : sizeof(rtstdb::SrgbColor);
  return pixels_ * ((options_.has_images ? color : 0) + (options_.depth_step_m > 0.0 ? sizeof(float) : 0));
}

ImageBuffer ImageEncoder::parts_of(std::span<std::byte> buffer) const noexcept {
  ImageBuffer parts;
  const auto take = [&]<class Sample>(std::span<Sample>& part) {
    part = {reinterpret_cast<Sample*>(buffer.data()), pixels_};
    buffer = buffer.subspan(part.size_bytes());
  };
  if (options_.has_images && sensor_.has_noise()) take(parts.color);
  if (options_.has_images && !sensor_.has_noise()) take(parts.srgb);
  if (options_.depth_step_m > 0.0) take(parts.depth_m);
  return parts;
}

void ImageEncoder::encode(std::span<std::byte> buffer, std::int64_t time_ns, FileOutput& files) {
  const ImageBuffer image = parts_of(buffer);
  char number[32];
  std::snprintf(number, sizeof number, "-%06lld", static_cast<long long>(time_ns / options_.tick_ns));
  const std::string name = "camera-" + options_.name + number;
  if (!image.depth_m.empty()) {
    const std::vector<std::uint16_t> depths = depth_samples(image.depth_m, options_.depth_step_m);
    files.write(
        name + "-depth.png",
        PngImage{.width = options_.width, .height = options_.height, .pixels = PngImage::Grey16{depths}});
  }
  if (!options_.has_images) return;
  if (!image.color.empty()) sensor_.develop(image.color, time_ns, developed_);
  const std::span<const rtstdb::SrgbColor> srgb = image.color.empty() ? image.srgb : std::span(developed_);
  for (std::size_t i = 0; i < srgb.size(); ++i)
    std::copy_n(srgb[i].begin(), 3, rgb_.begin() + static_cast<std::ptrdiff_t>(3 * i));
  if (!files.write(
          name + ".png",
          PngImage{.width = options_.width, .height = options_.height, .pixels = PngImage::Rgb8{rgb_}}))
    return;
  last_rgb_.resize(rgb_.size());
  std::swap(rgb_, last_rgb_);
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

}  // namespace hil::modules
