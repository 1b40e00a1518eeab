#pragma once
// The images of a pixel study: the intensity that a pixel measures in grey, a pixel that detects the
// reflector in white, a pixel that was not traced in black.
//
// add and finish do not allocate. Threads: one.

#include <cstdint>
#include <string>
#include <vector>

#include <hil/contribution.hpp>

#include "configs/docking/modules/pixel_study/study_options.hpp"

namespace hil::modules {

class StudyImages {
 public:
  /// Allocates a byte for each pixel, distance and method, and eight bytes for each pixel. `options` outlives
  /// it.
  explicit StudyImages(const StudyOptions& options);

  /// Adds the contribution of a ray or a beam to the mean intensity of its pixel: of all that it meets, and
  /// of the reflector.
  void add(std::uint32_t pixel, double intensity_per_m2, double of_reflector_per_m2) noexcept;
  /// Makes the image of a distance and a method from what was added since the last call.
  void finish(std::size_t distance, std::size_t method) noexcept;

  /// Adds copies of the finished images.
  void add_to(contribution::Contribution& report, const std::string& module) const;

 private:
  const StudyOptions& options_;
  std::vector<float> intensity_, of_reflector_;   // by pixel
  std::vector<std::vector<std::uint8_t>> greys_;  // by distance and method
  std::vector<bool> finished_;
};

}  // namespace hil::modules
