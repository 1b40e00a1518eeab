#pragma once
// What the database's log does not know of a run's world: what bodies, layers and sensors are called, and how sensors look. Written as
// world.json before the first tick, so that the history of a run that was killed can be asked too (history/run_history.hpp).
//
// Units: nanoseconds of run time, which is world time; metres; radians. Threads: plain data.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hil::report {

/// In world.json. A file with another number is refused.
inline constexpr int world_schema_version = 2;

/// Named as in the scenario: "house_1", "traffic.ego".
struct NamedEntity {
  std::string name;
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
};

/// A turning-mirror scanner, as modules/laser_scanner/scan_pattern.hpp has it.
struct Scanner {
  std::string name;  ///< of the module's instance
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
  std::int64_t first_sweep_ns = 0;
  std::int64_t sweep_ns = 0;
  std::int64_t step_ns =
      0;  ///< the beams of so long are asked together, on the world as it is when the step begins
};

struct WorldRecord {
  std::string scenario;
  std::string database_id;     ///< of the log that the names go with, in hexadecimal; empty: there is none
  std::int64_t period_ns = 0;  ///< of the base rate
  std::vector<std::string> layers;  ///< by bit of the masks
  std::vector<NamedEntity> entities;
  std::vector<Scanner> scanners;
};

}  // namespace hil::report
