#pragma once
// What a pixel study finds for each distance and method, and how the report shows it.
//
// Threads: one; section() allocates and is not for the tick.

#include <cstdint>
#include <string>
#include <vector>

#include <hil/section.hpp>

#include "configs/docking/modules/pixel_study/pixel_grid.hpp"
#include "configs/docking/modules/pixel_study/study_options.hpp"

namespace hil::modules {

/// The wall-clock time of transactions, and the number of pixels that they traced, with repetitions.
struct TimedPixels {
  std::int64_t wall_ns = 0;
  std::uint64_t pixels = 0;

  double ns_per_pixel() const noexcept {
    return pixels > 0 ? static_cast<double>(wall_ns) / static_cast<double>(pixels) : 0.0;
  }
};

struct MethodResult {
  bool complete = false;
  std::uint32_t detections = 0;          ///< shifts in which a pixel detected the reflector
  TimedPixels port{};                    ///< of the pixels that can see the port
  std::uint64_t port_pixels = 0;         ///< their number, without repetitions
  TimedPixels beside_port{};             ///< of the pixels beside it, as far as they were traced
  std::uint64_t pixels_beside_port = 0;  ///< their number, traced or not

  /// The time for all pixels of the grid; estimated if not all pixels beside the port were traced.
  double frame_s() const noexcept {
    return 1e-9 * (port.ns_per_pixel() * static_cast<double>(port_pixels) +
                   beside_port.ns_per_pixel() * static_cast<double>(pixels_beside_port));
  }
};

class StudyResult {
 public:
  /// `options` outlives it.
  StudyResult(const StudyOptions& options, const PixelGrid& grid);

  MethodResult& at(std::size_t distance, std::size_t method) noexcept {
    return results_[distance * options_.methods.size() + method];
  }
  const MethodResult& at(std::size_t distance, std::size_t method) const noexcept {
    return results_[distance * options_.methods.size() + method];
  }

  bool detects(std::size_t distance, std::size_t method) const noexcept {
    return at(distance, method).detections >= options_.needed_shifts;
  }
  /// Whether the beams of a method cover their pixels.
  bool tiles(const PixelMethod& method) const noexcept;
  /// The distance of Equation 2 for rays; for beams 0.
  double equation_2_m(const PixelMethod& method) const noexcept;

  /// The number of complete results of beams that tile the view and do not detect.
  std::uint32_t missed_by_tiling_beams() const noexcept;
  /// The number of complete results of rays that detect beyond `factor` times the distance of Equation 2.
  std::uint32_t detected_by_rays_beyond(double factor) const noexcept;

  contribution::Section section(const std::string& module) const;

 private:
  contribution::Table table() const;
  contribution::Plot detection_plot() const;
  contribution::Plot time_plot() const;

  const StudyOptions& options_;
  const PixelGrid grid_;
  std::vector<MethodResult> results_;
};

}  // namespace hil::modules
