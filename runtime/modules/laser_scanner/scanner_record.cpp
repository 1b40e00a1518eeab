#include "runtime/modules/laser_scanner/scanner_record.hpp"

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>
#include <variant>

#include <rtstdb/limits.hpp>

namespace hil::modules {
namespace {

/// Calls visit(key, member) for each property, in the order of the file. `Scanner` may be const.
template <class Scanner, class Visit>
void each_property(Scanner& scanner, Visit&& visit) {
  visit("carrier_index", scanner.carrier_index);
  visit("carrier_generation", scanner.carrier_generation);
  visit("mount_m", scanner.mount_m);
  visit("columns", scanner.columns);
  visit("rows", scanner.rows);
  visit("horizontal_rad", scanner.horizontal_rad);
  visit("vertical_rad", scanner.vertical_rad);
  visit("elevation_rad", scanner.elevation_rad);
  visit("left_to_right", scanner.left_to_right);
  visit("range_m", scanner.range_m);
  visit("mask", scanner.mask);
  visit("ignore_motion", scanner.ignore_motion);
  visit("divergence_rad", scanner.divergence_rad);
  visit("returns_per_beam", scanner.returns_per_beam);
  visit("fast_beams", scanner.mode);
  visit("threshold_per_m2", scanner.threshold_per_m2);
  visit("range_noise_m", scanner.range_noise_m);
  visit("noise_seed", scanner.noise_seed);
  visit("first_sweep_ns", scanner.first_sweep_ns);
  visit("sweep_ns", scanner.sweep_ns);
  visit("step_ns", scanner.step_ns);
}

[[noreturn]] void refuse(const contribution::ModuleRecord& record, const std::string& fault) {
  throw RecordError("world.json: scanner '" + record.name + "': " + fault);
}

using Value = decltype(contribution::Property::value);

bool take(const Value& value, bool& member) {
  const bool* const given = std::get_if<bool>(&value);
  if (given != nullptr) member = *given;
  return given != nullptr;
}

/// world.json holds a mode as a flag: true for the fast one.
bool take(const Value& value, rtstdb::ConeMode& member) {
  const bool* const is_fast = std::get_if<bool>(&value);
  if (is_fast != nullptr) member = *is_fast ? rtstdb::ConeMode::fast : rtstdb::ConeMode::exact;
  return is_fast != nullptr;
}

template <class Integer>
requires(std::is_integral_v<Integer> && !std::same_as<Integer, bool>) bool take(const Value& value,
                                                                                Integer& member) {
  const std::int64_t* const given = std::get_if<std::int64_t>(&value);
  if (given == nullptr || !std::in_range<Integer>(*given)) return false;
  member = static_cast<Integer>(*given);
  return true;
}

bool take(const Value& value, double& member) {
  if (const std::int64_t* const whole = std::get_if<std::int64_t>(&value)) {
    member = static_cast<double>(*whole);
    return true;
  }
  const double* const given = std::get_if<double>(&value);
  if (given != nullptr) member = *given;
  return given != nullptr;
}

bool take(const Value& value, std::array<double, 3>& member) {
  const auto* const given = std::get_if<std::vector<double>>(&value);
  if (given == nullptr || given->size() != member.size()) return false;
  std::copy(given->begin(), given->end(), member.begin());
  return true;
}

template <class Member>
Value value_of(const Member& member) {
  if constexpr (std::same_as<Member, std::array<double, 3>>) {
    return std::vector<double>(member.begin(), member.end());
  } else if constexpr (std::same_as<Member, rtstdb::ConeMode>) {
    return member == rtstdb::ConeMode::fast;
  } else if constexpr (std::is_integral_v<Member> && !std::same_as<Member, bool>) {
    return static_cast<std::int64_t>(member);
  } else {
    return member;
  }
}

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
  contribution::ModuleRecord record{.list = scanner_list, .name = scanner.name, .properties = {}};
  each_property(scanner, [&](const char* key, const auto& member) {
    record.properties.push_back({key, value_of(member)});
  });
  return record;
}

ScannerRecord to_scanner_record(const contribution::ModuleRecord& record) {
  ScannerRecord scanner;
  scanner.name = record.name;
  each_property(scanner, [&](const char* key, auto& member) {
    const auto found = std::ranges::find(record.properties, key, &contribution::Property::key);
    if (found == record.properties.end()) refuse(record, std::string("property '") + key + "' is missing");
    if (!take(found->value, member))
      refuse(record, std::string("property '") + key + "' has a value of another type or range");
  });
  if (const std::string fault = fault_of(scanner); !fault.empty()) {
    refuse(record, fault + " is beyond the limits of the module's parameters");
  }
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
