#include "runtime/modules/laser_scanner/scanner_record.hpp"

#include <rtstdb/limits.hpp>

namespace hil::modules {
namespace {

/// The value that is beyond the limits of the module's parameters; empty: none.
std::string fault_of(const ScannerRecord& scanner) {
  constexpr double max_angle_rad = 6.3;       // a whole turn, and what rounding adds
  constexpr double max_divergence_rad = 1.6;  // a right angle, and what rounding adds
  constexpr std::int64_t max_sweep_ns = 10'000'000'000;
  const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
  if (scanner.columns < 2 || scanner.columns > 16384 || scanner.rows < 1 || scanner.rows > 8192)
    return "a sweep of " + std::to_string(scanner.columns) + " columns of " + std::to_string(scanner.rows) +
           " beams";
  if (!within(scanner.horizontal_rad, 0.0, max_angle_rad) ||
      !within(scanner.vertical_rad, 0.0, max_angle_rad) ||
      !within(scanner.elevation_rad, -max_angle_rad, max_angle_rad))
    return "an angle";
  if (!within(scanner.range_m, 0.0, 1e4)) return "the range";
  if (!within(scanner.divergence_rad, 0.0, max_divergence_rad)) return "the divergence";
  if (scanner.returns_per_beam < 1 || scanner.returns_per_beam > rtstdb::max_returns_per_cone)
    return std::to_string(scanner.returns_per_beam) + " returns of a beam";
  if (!within(scanner.threshold_per_m2, 0.0, 1e12)) return "the threshold";
  if (!within(scanner.range_noise_m, 0.0, 100.0)) return "the noise of the range";
  if (scanner.sweep_ns <= 0 || scanner.sweep_ns > max_sweep_ns || scanner.step_ns <= 0 ||
      scanner.sweep_ns % scanner.step_ns != 0)
    return "a sweep of " + std::to_string(scanner.sweep_ns) + " ns in steps of " +
           std::to_string(scanner.step_ns) + " ns";
  if (scanner.first_sweep_ns < 0 || scanner.first_sweep_ns > rtstdb::max_world_time_ns / 2)
    return "a first sweep at " + std::to_string(scanner.first_sweep_ns) + " ns";
  for (const double mount_m : scanner.mount_m)
    if (!within(mount_m, -rtstdb::max_coordinate_m, rtstdb::max_coordinate_m)) return "the mounting position";
  return {};
}

}  // namespace

contribution::ModuleRecord to_module_record(const ScannerRecord& scanner) {
  return properties_of(scanner, scanner_list, scanner.name);
}

ScannerRecord to_scanner_record(const contribution::ModuleRecord& record) {
  auto scanner = record_of<ScannerRecord>(record, "scanner");
  scanner.name = record.name;
  if (const std::string fault = fault_of(scanner); !fault.empty())
    refuse_record("scanner", record.name, fault + " is beyond the limits of the module's parameters");
  return scanner;
}

ScanPattern pattern_of(const ScannerRecord& scanner) {
  return ScanPattern({.columns = scanner.columns,
                      .rows = scanner.rows,
                      .horizontal_rad = scanner.horizontal_rad,
                      .vertical_rad = scanner.vertical_rad,
                      .elevation_rad = scanner.elevation_rad,
                      .period_ns = scanner.sweep_ns,
                      .left_to_right = scanner.left_to_right});
}

}  // namespace hil::modules
