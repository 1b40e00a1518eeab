#pragma once
// The outputs of a laser scanner and their places.
//
//     object<i>.valid, .x, .y (m), .vx, .vy (m/s over ground), .length (m), .age (ms)
//                      objects in the carrier's axes at the instant they were measured, `age` ago; the origin
//                      is list_origin
//     object_count
//     scan_index       sweeps begun before this one
//     hits             beams of the last step with a detected return
//     digest           a hash of all answers so far: runs with equal digests have equal answers
// With `targets`, of the last sweep whose last beams have answers:
//     target_count     detected returns of retro-reflectors
//     target<k>.azimuth, .elevation (rad), .range (m), .intensity (1/m^2)
//                      the brightest of them; 0 in slots without one. The direction is that of the beam's
//                      axis in the sensor frame.

#include <cstddef>
#include <cstdint>

#include <hil/world/world_module.hpp>

#include "runtime/modules/laser_scanner/scanner_options.hpp"

namespace hil::modules {

WorldPorts scanner_ports(const config::Value& parameters, const ScannerOptions& options);

/// Indices in Ports::outputs.
class ScannerOutputs {
 public:
  static constexpr std::size_t per_object = 7;
  static constexpr std::size_t per_target = 4;

  explicit ScannerOutputs(const ScannerOptions& options) noexcept
      : after_objects_(options.max_objects * per_object) {}
  std::size_t object_count() const noexcept { return after_objects_; }
  std::size_t scan_index() const noexcept { return after_objects_ + 1; }
  std::size_t hits() const noexcept { return after_objects_ + 2; }
  std::size_t digest() const noexcept { return after_objects_ + 3; }
  std::size_t target_count() const noexcept { return after_objects_ + 4; }
  /// The first of per_target outputs.
  std::size_t target(std::uint32_t k) const noexcept { return after_objects_ + 5 + k * per_target; }

 private:
  std::size_t after_objects_;
};

}  // namespace hil::modules
