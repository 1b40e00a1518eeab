#pragma once
// The brightest detected returns of retro-reflectors in a sweep.
//
// No allocation. Threads: one.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hil::modules {

/// Direction of the beam's axis in the sensor frame, and what the receiver measured.
struct Target {
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;
  double range_m = 0.0;
  double intensity_per_m2 = 0.0;
};

class TargetList {
 public:
  static constexpr std::uint32_t max_targets = 8;

  /// `capacity`: how many targets are kept, at most max_targets.
  explicit TargetList(std::uint32_t capacity) noexcept : capacity_(capacity) {}

  void clear() noexcept { found_ = kept_ = 0; }
  void add(const Target& target) noexcept;

  /// The number of targets added since clear, whether kept or not.
  std::uint64_t found() const noexcept { return found_; }
  /// The brightest first; of equally bright ones, the one added first.
  std::span<const Target> brightest() const noexcept { return std::span(targets_).first(kept_); }

 private:
  std::uint32_t capacity_;
  std::array<Target, max_targets> targets_{};
  std::size_t kept_ = 0;
  std::uint64_t found_ = 0;
};

}  // namespace hil::modules
