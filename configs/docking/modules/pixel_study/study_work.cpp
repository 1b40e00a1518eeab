#include "configs/docking/modules/pixel_study/study_work.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>

#include <hil/splitmix64.hpp>

namespace hil::modules {
namespace {

/// In [0, 1).
double uniform(std::uint64_t state) noexcept {
  return static_cast<double>(splitmix64(state) >> 11) * 0x1p-53;
}

/// The rotation of a sensor that looks along `forward`, with the world's z up in its images, or x where it
/// looks along z.
glm::dquat looking_along(const glm::dvec3& forward) {
  const glm::dvec3 z(0.0, 0.0, 1.0), x(1.0, 0.0, 0.0);
  const glm::dvec3 left = glm::normalize(glm::cross(std::abs(forward.z) < 0.99 ? z : x, forward));
  return glm::quat_cast(glm::dmat3(forward, left, glm::cross(forward, left)));
}

}  // namespace

StudyWork::StudyWork(const StudyOptions& options, const PixelGrid& grid, const StudyScene& scene,
                     std::uint64_t seed)
    : options_(options),
      grid_(grid),
      scene_(scene),
      seed_(seed),
      sensor_to_world_(looking_along(-scene.axis)) {
  for (std::uint32_t i = 0; i < options.shifts; ++i)
    shifts_.emplace_back(uniform(seed + 2 * i), uniform(seed + 2 * i + 1));
  chosen_pixels_.reserve(std::size_t{grid.pixels()} * grid.pixels());
  for (distance_ = 0; distance_ < options.distances_m.size(); ++distance_) {
    set_distance();
    for (method_ = 0; method_ < options.methods.size(); ++method_)
      max_detection_pixels_ = std::max(max_detection_pixels_, reflector_window().size() * options.shifts);
  }
  distance_ = method_ = 0;
  set_distance();
  set_method();
}

/// The pixels that can see the reflector in any shift.
PixelWindow StudyWork::reflector_window() const noexcept {
  const glm::dvec3 to_reflector = glm::conjugate(sensor_to_world_) * (scene_.reflector_m - sensor_m_);
  const double range_m = glm::length(to_reflector);
  const double radius_rad =
      std::atan2(0.5 * options_.reflector_m, range_m) + 0.5 * options_.methods[method_].beam_rad;
  // A shift moves the pixels by less than one to the right and down, so the place of the reflector in the
  // shifted grid is smaller by less than one. Another half pixel is for a beam in the middle of its pixel,
  // and for rounding.
  const glm::dvec2 place = grid_.place(to_reflector) - glm::dvec2(0.5);
  return window_around(grid_, place, radius_rad / grid_.pitch_rad() + 1.0);
}

void StudyWork::set_distance() noexcept {
  sensor_m_ = scene_.port_m + options_.distances_m[distance_] * scene_.axis;
  const double radius_rad = std::atan2(options_.port_radius_m, options_.distances_m[distance_]);
  port_window_ = window_around(grid_, glm::dvec2(0.5 * grid_.pixels()), radius_rad / grid_.pitch_rad() + 0.5);
}

void StudyWork::set_method() noexcept {
  detection_window_ = reflector_window();
}

void StudyWork::choose_pixels() noexcept {
  chosen_pixels_.clear();
  const PixelMethod& method = options_.methods[method_];
  const bool all = method.is_beam() || method.samples() <= options_.all_pixels_up_to_samples;
  for (std::uint32_t row = 0; row < grid_.pixels(); ++row) {
    for (std::uint32_t column = 0; column < grid_.pixels(); ++column) {
      if (port_window_.has(column, row)) continue;
      const std::uint32_t pixel = row * grid_.pixels() + column;
      if (all || uniform(seed_ ^ (std::uint64_t{pixel} << 20)) < options_.share_beside_port)
        chosen_pixels_.push_back(pixel);
    }
  }
}

void StudyWork::next_item() noexcept {
  if (purpose_ == StudyPurpose::detection) {
    purpose_ = StudyPurpose::port;
    return;
  }
  if (purpose_ == StudyPurpose::port) {
    purpose_ = StudyPurpose::beside_port;
    choose_pixels();
    return;
  }
  purpose_ = StudyPurpose::detection;
  if (++method_ == options_.methods.size()) {
    method_ = 0;
    if (++distance_ == options_.distances_m.size()) return;
    set_distance();
  }
  set_method();
}

std::uint64_t StudyWork::pixels() const noexcept {
  if (purpose_ == StudyPurpose::detection) return detection_window_.size() * options_.shifts;
  return purpose_ == StudyPurpose::port ? port_window_.size() : chosen_pixels_.size();
}

std::uint64_t StudyWork::elements() const noexcept {
  return repetitions() * pixels() * options_.methods[method_].samples();
}

std::uint64_t StudyWork::repetitions() const noexcept {
  if (purpose_ != StudyPurpose::port) return 1;
  const std::uint64_t once = pixels() * options_.methods[method_].samples();
  return (min_port_elements + once - 1) / once;
}

StudyElement StudyWork::element(std::uint64_t index) const noexcept {
  const PixelMethod& method = options_.methods[method_];
  const std::uint64_t number = index / method.samples() % pixels();
  const auto sample = static_cast<std::uint32_t>(index % method.samples());
  const auto in_window = [](const PixelWindow& window, std::uint64_t n) {
    const std::uint64_t column = window.first_column + n % window.width();
    const std::uint64_t row = window.first_row + n / window.width();
    return glm::dvec2(column, row);
  };
  StudyElement element{.pixel = static_cast<std::uint32_t>(number)};
  glm::dvec2 corner(0.0), shift(0.0);
  if (purpose_ == StudyPurpose::detection) {
    corner = in_window(detection_window_, number % detection_window_.size());
    shift = shifts_[number / detection_window_.size()];
  } else {
    if (purpose_ == StudyPurpose::port) {
      corner = in_window(port_window_, number);
      element.pixel =
          static_cast<std::uint32_t>(corner.y) * grid_.pixels() + static_cast<std::uint32_t>(corner.x);
    } else {
      element.pixel = chosen_pixels_[number];
      const std::uint32_t column = element.pixel % grid_.pixels();
      const std::uint32_t row = element.pixel / grid_.pixels();
      corner = {column, row};
    }
  }
  const std::uint32_t n = method.samples_per_axis;
  const std::uint32_t sample_column = sample % n, sample_row = sample / n;
  const glm::dvec2 in_pixel((sample_column + 0.5) / n, (sample_row + 0.5) / n);
  element.direction_world = sensor_to_world_ * grid_.direction(corner + shift + in_pixel);
  return element;
}

std::size_t StudyWork::items_done() const noexcept {
  return 3 * (distance_ * options_.methods.size() + method_) + static_cast<std::size_t>(purpose_);
}

}  // namespace hil::modules
