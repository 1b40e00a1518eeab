#include "configs/docking/modules/pixel_study/study_images.hpp"

#include <algorithm>
#include <cmath>

#include <hil/numbers.hpp>

namespace hil::modules {
namespace {

constexpr std::uint8_t white = 255;
/// Of a matt white surface that faces the sensor.
constexpr double brightest_grey = 200.0;

/// Such as "0100m-4096rays" and "0020m-beam0p0524deg": letters, digits and '-'.
std::string file_name(double distance_m, const PixelMethod& method) {
  const std::string distance = config::format_number(distance_m);
  std::string name = std::string(4 - std::min<std::size_t>(distance.size(), 4), '0') + distance + "m-";
  if (method.is_beam()) {
    const double degrees = method.beam_rad * 57.29577951308232;
    name += "beam" + config::format_number(std::round(degrees * 1e6) / 1e6) + "deg";
  } else {
    name += std::to_string(method.samples()) + "rays";
  }
  std::ranges::replace(name, '.', 'p');
  return name;
}

}  // namespace

StudyImages::StudyImages(const StudyOptions& options) : options_(options) {
  const std::size_t pixels = std::size_t{options.pixels} * options.pixels;
  intensity_.resize(pixels);
  of_reflector_.resize(pixels);
  greys_.resize(options.distances_m.size() * options.methods.size(), std::vector<std::uint8_t>(pixels));
  finished_.resize(greys_.size());
}

void StudyImages::add(std::uint32_t pixel, double intensity_per_m2, double of_reflector_per_m2) noexcept {
  intensity_[pixel] += static_cast<float>(intensity_per_m2);
  of_reflector_[pixel] += static_cast<float>(of_reflector_per_m2);
}

void StudyImages::finish(std::size_t distance, std::size_t method) noexcept {
  const std::size_t number = distance * options_.methods.size() + method;
  const double range_m = options_.distances_m[distance];
  for (std::size_t pixel = 0; pixel < intensity_.size(); ++pixel) {
    // Times range squared: the share of the light that comes back, whatever the distance.
    const double share = std::clamp(static_cast<double>(intensity_[pixel]) * range_m * range_m, 0.0, 1.0);
    greys_[number][pixel] = static_cast<double>(of_reflector_[pixel]) > options_.threshold_per_m2
                                ? white
                                : static_cast<std::uint8_t>(brightest_grey * std::sqrt(share));
  }
  finished_[number] = true;
  std::ranges::fill(intensity_, 0.0f);
  std::ranges::fill(of_reflector_, 0.0f);
}

void StudyImages::add_to(contribution::Contribution& report, const std::string& module) const {
  for (std::size_t number = 0; number < greys_.size(); ++number) {
    if (!finished_[number]) continue;
    const std::size_t methods = options_.methods.size();
    report.images.push_back(
        {.name = module + "-" +
                 file_name(options_.distances_m[number / methods], options_.methods[number % methods]),
         .width = options_.pixels,
         .height = options_.pixels,
         .grey = greys_[number]});
  }
}

}  // namespace hil::modules
