#pragma once
// What a history needs to know of a laser scanner to trace its beams again: the module writes it into
// world.json (contribution::ModuleRecord, in the list "scanners"), and `hil history` reads it.
//
// Units: nanoseconds of run time, which is world time; metres; radians. Threads: plain data.

#include <array>
#include <cstdint>
#include <string>

#include <hil/record.hpp>

#include "runtime/contribution/world_record.hpp"
#include "runtime/modules/laser_scanner/scan_pattern.hpp"

namespace hil::modules {

/// The key of world.json whose list holds the scanners.
inline constexpr const char* scanner_list = "scanners";

struct ScannerRecord {
  std::string name;  ///< of the module in the scenario
  std::uint32_t carrier_index = 0;
  std::uint32_t carrier_generation = 0;
  std::array<double, 3> mount_m{};  ///< in the carrier's frame
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  double horizontal_rad = 0.0;
  double vertical_rad = 0.0;
  double elevation_rad = 0.0;
  bool left_to_right = true;
  double range_m = 0.0;
  std::uint32_t mask = 0;
  bool ignore_motion = false;
  double divergence_rad = 0.0;
  std::uint32_t returns_per_beam = 1;
  bool fast_beams = false;  ///< rtstdb::ConeMode::fast
  double threshold_per_m2 = 0.0;
  double range_noise_m = 0.0;
  std::int64_t noise_seed = 0;
  std::int64_t first_sweep_ns = 0;
  std::int64_t sweep_ns = 0;
  /// The beams of one step of the module are one query, on the version at the step's begin.
  std::int64_t step_ns = 0;

  template <class Self, class Visit>
  static void each_property(Self& self, Visit&& visit) {
    visit("carrier_index", self.carrier_index);
    visit("carrier_generation", self.carrier_generation);
    visit("mount_m", self.mount_m);
    visit("columns", self.columns);
    visit("rows", self.rows);
    visit("horizontal_rad", self.horizontal_rad);
    visit("vertical_rad", self.vertical_rad);
    visit("elevation_rad", self.elevation_rad);
    visit("left_to_right", self.left_to_right);
    visit("range_m", self.range_m);
    visit("mask", self.mask);
    visit("ignore_motion", self.ignore_motion);
    visit("divergence_rad", self.divergence_rad);
    visit("returns_per_beam", self.returns_per_beam);
    visit("fast_beams", self.fast_beams);
    visit("threshold_per_m2", self.threshold_per_m2);
    visit("range_noise_m", self.range_noise_m);
    visit("noise_seed", self.noise_seed);
    visit("first_sweep_ns", self.first_sweep_ns);
    visit("sweep_ns", self.sweep_ns);
    visit("step_ns", self.step_ns);
  }
};

contribution::ModuleRecord to_module_record(const ScannerRecord& scanner);

/// Throws RecordError with the name of the property.
ScannerRecord to_scanner_record(const contribution::ModuleRecord& record);

ScanPattern pattern_of(const ScannerRecord& scanner);

}  // namespace hil::modules
