#pragma once
// The images of a pixel study: the intensity of all that a pixel sees as grey, and white where it detects the
// reflector. Pixels that were not traced are black.
//
// add and finish do not allocate. Threads: one.

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/contribution/contribution.hpp"
#include "runtime/modules/pixel_study/study_options.hpp"

namespace hil::modules {

class StudyImages {
 public:
  /// Takes a byte for each pixel, distance and method, and eight for each pixel. `options` outlives it.
  explicit StudyImages(const StudyOptions& options);

  /// The mean intensities of the rays or of the beam: add one ray's share of a pixel.
  void add(std::uint32_t pixel, double intensity_per_m2, double of_reflector_per_m2) noexcept;
  /// Makes the image of a distance and a method of what was added since the last one.
  void finish(std::size_t distance, std::size_t method) noexcept;

  /// Adds those that are finished, with copies of their pixels.
  void add_to(contribution::Contribution& report, const std::string& module) const;

 private:
  const StudyOptions& options_;
  std::vector<float> intensity_, of_reflector_;   // by pixel
  std::vector<std::vector<std::uint8_t>> greys_;  // by distance and method
  std::vector<bool> finished_;
};

}  // namespace hil::modules
