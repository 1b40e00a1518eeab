#pragma once
// The parameters of a laser scanner.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>
#include <rtstdb/query.hpp>

#include "runtime/modules/laser_scanner/scan_pattern.hpp"

namespace hil::modules {

/// Positions are in the carrier's frame.
struct ScannerOptions {
  std::string carrier;
  glm::dvec3 mount_m{0.0};
  glm::dvec3 list_origin_m{0.0};
  PatternOptions pattern;
  double range_m = 0.0;
  std::vector<std::string> layers, object_layers, compare;
  std::uint32_t max_objects = 0;
  std::int64_t keep_ns = 0;
  bool ignore_motion = false;
  double divergence_rad = 0.0;  ///< full opening angle of a beam; 0: rays
  std::uint32_t returns_per_beam = 1;
  rtstdb::ConeMode mode = rtstdb::ConeMode::exact;  ///< of beams
  double threshold_per_m2 = 0.0;
  double range_noise_m = 0.0;
  std::uint32_t targets = 0;       ///< slots for returns of retro-reflectors; 0: no such outputs
  std::uint32_t cloud_sweeps = 0;  ///< sweeps from one point cloud to the next; 0: no point clouds
};

/// The largest number of points of a cloud.
inline constexpr std::uint64_t max_cloud_points = std::uint64_t{1} << 22;

config::Schema scanner_schema();
/// `parameters` conform to the schema.
ScannerOptions read_scanner_options(const config::Value& parameters);
/// Adds a mistake for each parameter that contradicts another one.
void check_scanner_options(const config::Value& parameters, config::Diagnostics& diagnostics);
/// Adds a mistake for each parameter that a task with steps of `step_ns` does not permit.
void check_scanner_task(const config::Value& parameters, const ScanPattern& pattern, std::int64_t step_ns,
                        config::Diagnostics& diagnostics);

}  // namespace hil::modules
