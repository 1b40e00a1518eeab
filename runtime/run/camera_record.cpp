#include "runtime/run/camera_record.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <rtstdb/srgb.hpp>

#include "runtime/report/quantities.hpp"
#include "runtime/run/base64.hpp"
#include "runtime/run/png_file.hpp"

namespace hil::run {
namespace {

std::uint8_t srgb_of(double linear) {
  return static_cast<std::uint8_t>(
      std::lround(255.0 * rtstdb::srgb_from_linear(std::clamp(linear, 0.0, 1.0))));
}

/// "1 image of camera front is not in a file".
std::string images_without_file(std::uint64_t count, const std::string& which) {
  return count == 1 ? "1 image " + which + " is not in a file"
                    : std::to_string(count) + " images " + which + " are not in files";
}

void add_sentences(const CameraFileRecord& files, report::RunRecord& record) {
  const std::string camera = "of camera " + files.name;
  if (files.dropped > 0)
    record.failures.push_back(images_without_file(files.dropped, camera) + ": the disk was too slow");
  if (files.failed > 0)
    record.failures.push_back(std::to_string(files.failed) + (files.failed == 1 ? " file " : " files ") +
                              camera + " could not be written; the first: " + files.first_fault);
  if (files.beyond_limit > 0)
    record.realtime.degraded.push_back("the files " + camera + " reached " +
                                       report::bytes_text(files.max_bytes) + " ('max_size'); " +
                                       images_without_file(files.beyond_limit, "after that"));
}

}  // namespace

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
        small.rgb.push_back(srgb_of(sum / ((end_x - x) * (end_y - y))));
      }
    }
  }
  return small;
}

void add_cameras(std::span<const contribution::Camera> cameras, std::span<const CameraFileRecord> files,
                 report::RunRecord& record) {
  for (const contribution::Camera& camera : cameras) {
    report::Camera entry{.name = camera.name,
                         .images = camera.images,
                         .missing_tiles = camera.missing_tiles,
                         .exposure_value = camera.exposure_value};
    const auto found = std::ranges::find(files, camera.name, &CameraFileRecord::name);
    if (found != files.end()) {
      entry.dropped = found->dropped;
      entry.beyond_limit = found->beyond_limit;
      entry.last_file = found->last_file;
      entry.last_time_ns = found->last_time_ns;
      if (found->last_time_ns && record.period_ns > 0)
        entry.last_tick = static_cast<std::uint64_t>(*found->last_time_ns / record.period_ns);
      if (!found->last_rgb.empty()) {
        const SmallImage small = reduced(found->width, found->height, found->last_rgb, max_report_pixels);
        entry.last_image_png = base64(
            png_bytes({.width = small.width, .height = small.height, .pixels = PngImage::Rgb8{small.rgb}}));
      }
      add_sentences(*found, record);
    }
    record.cameras.push_back(std::move(entry));
  }
}

}  // namespace hil::run
