#pragma once
// The work of a pixel study as a sequence of items. An item is a number of elements (rays or beams), which
// can be traced in batches of any size. Each distance and method has three items: the detection in all
// shifts, the pixels that can see the port, and the other pixels.
//
// No allocation after construction. Threads: one.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double2.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <vector>

#include "configs/docking/modules/pixel_study/pixel_grid.hpp"
#include "configs/docking/modules/pixel_study/study_options.hpp"

namespace hil::modules {

/// The port and the reflector in the world.
struct StudyScene {
  glm::dvec3 port_m{0.0};
  glm::dvec3 axis{1.0, 0.0, 0.0};
  glm::dvec3 reflector_m{0.0};
};

enum class StudyPurpose : std::uint8_t { detection, port, beside_port };

/// The pixels that can see the port are traced repeatedly until at least this many rays or beams have been
/// traced: the time of a small batch would be mostly that of its transaction.
constexpr std::uint64_t min_port_elements = 4096;

/// One ray or beam.
struct StudyElement {
  glm::dvec3 direction_world{1.0, 0.0, 0.0};
  /// detection: the number of the pixel in its shift's window, counted over all shifts; else the number of
  /// the pixel in the grid, row by row.
  std::uint32_t pixel = 0;
};

class StudyWork {
 public:
  /// `options` outlives it.
  StudyWork(const StudyOptions& options, const PixelGrid& grid, const StudyScene& scene, std::uint64_t seed);

  bool is_over() const noexcept { return distance_ == options_.distances_m.size(); }
  /// Begins the next item. Misuse: is_over().
  void next_item() noexcept;

  // Of the current item. Misuse: is_over().
  std::size_t distance() const noexcept { return distance_; }
  std::size_t method() const noexcept { return method_; }
  StudyPurpose purpose() const noexcept { return purpose_; }
  std::uint64_t elements() const noexcept;
  StudyElement element(std::uint64_t index) const noexcept;
  const glm::dvec3& sensor_m() const noexcept { return sensor_m_; }
  /// The pixels of one shift that can see the reflector; they have the same numbers in all shifts.
  std::uint64_t pixels_of_a_shift() const noexcept { return detection_window_.size(); }
  std::uint64_t pixels() const noexcept;  ///< of the item
  /// How often each pixel is traced.
  std::uint64_t repetitions() const noexcept;
  /// True for an element that was traced before.
  bool is_repeated(std::uint64_t index) const noexcept { return index >= elements() / repetitions(); }
  /// The number of pixels that can not see the port, traced or not.
  std::uint64_t pixels_beside_port() const noexcept {
    return std::uint64_t{grid_.pixels()} * grid_.pixels() - port_window_.size();
  }

  /// The largest number of pixels of a detection.
  std::uint64_t max_detection_pixels() const noexcept { return max_detection_pixels_; }
  std::size_t items() const noexcept { return 3 * options_.distances_m.size() * options_.methods.size(); }
  std::size_t items_done() const noexcept;

 private:
  void set_distance() noexcept;
  void set_method() noexcept;
  void choose_pixels() noexcept;
  PixelWindow reflector_window() const noexcept;

  const StudyOptions& options_;
  const PixelGrid grid_;
  const StudyScene scene_;
  const std::uint64_t seed_;
  glm::dquat sensor_to_world_{1.0, 0.0, 0.0, 0.0};
  std::vector<glm::dvec2> shifts_;  ///< in pixels

  std::size_t distance_ = 0, method_ = 0;
  StudyPurpose purpose_ = StudyPurpose::detection;
  glm::dvec3 sensor_m_{0.0};
  PixelWindow detection_window_, port_window_;
  std::vector<std::uint32_t> chosen_pixels_;  ///< those that StudyPurpose::beside_port traces
  std::uint64_t max_detection_pixels_ = 0;
};

}  // namespace hil::modules
