#pragma once
// The part of a run's record on its cameras.
//
// Threads: after the last tick.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/contribution/contribution.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/camera_files.hpp"

namespace hil::run {

/// The report shows an image of at most so many pixels.
inline constexpr std::uint64_t max_report_pixels = 640 * 480;

struct SmallImage {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb{};  ///< sRGB
};

/// Squares of pixels become one, with the mean of their linear values, so that at most `max_pixels` remain.
SmallImage reduced(std::uint32_t width, std::uint32_t height, std::span<const std::uint8_t> rgb,
                   std::uint64_t max_pixels);

/// Fills in record.cameras, and adds sentences on missing files to record.failures and on files beyond the
/// limit to record.realtime.degraded. `files`: of those cameras that write any.
void add_cameras(std::span<const contribution::Camera> cameras, std::span<const CameraFileRecord> files,
                 report::RunRecord& record);

}  // namespace hil::run
