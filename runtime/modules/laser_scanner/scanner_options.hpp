#pragma once
// The parameters of a laser scanner.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/config/schema.hpp"
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
};

config::Schema scanner_schema();
/// `parameters` conform to the schema.
ScannerOptions read_scanner_options(const config::Value& parameters);

}  // namespace hil::modules
