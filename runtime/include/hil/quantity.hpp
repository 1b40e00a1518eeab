#pragma once
// The units a quantity may be written in.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <hil/schema.hpp>

namespace hil::config {

/// One unit is numerator / denominator of the SI unit.
struct Unit {
  std::string_view symbol;
  double numerator = 1.0;
  double denominator = 1.0;
  std::int64_t nanoseconds = 0;  ///< durations: the unit in whole nanoseconds
};

/// The SI unit first; of a share, the only one: per cent.
std::span<const Unit> units_of(Quantity quantity);

/// "a speed"
std::string_view name_with_article(Quantity quantity);

/// "m/s, km/h"
std::string unit_list(Quantity quantity);

struct QuantityReading {
  double value_si = 0.0;
  std::int64_t nanoseconds = 0;  ///< durations
  const Unit* unit = nullptr;
  std::string fault;  ///< empty, or a clause that states what is wrong and which units would do
};

/// "50 km/h" (the blank is optional). A duration is exact to the nanosecond, and its value in seconds is the
/// double nearest to that.
QuantityReading read_quantity(std::string_view text, Quantity quantity);

/// A value in SI, written in `unit`: "50 km/h".
std::string format_quantity(double value_si, const Unit& unit);

/// A limit of the quantity: a size of data in the largest unit in which it is a whole number ("1 TiB"),
/// another quantity in `unit`.
std::string format_limit(double value_si, Quantity quantity, const Unit& unit);

/// "1.5 ms"
std::string format_duration(std::int64_t nanoseconds);

}  // namespace hil::config
