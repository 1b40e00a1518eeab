#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>
#include <hil/require.hpp>

#include "runtime/contract/trimmed.hpp"

namespace hil::config {
namespace {

constexpr double pi = std::numbers::pi;

constexpr std::array lengths{Unit{"m", 1, 1}, Unit{"cm", 1, 100}, Unit{"mm", 1, 1000}, Unit{"km", 1000, 1}};
constexpr std::array speeds{Unit{"m/s", 1, 1}, Unit{"km/h", 5, 18}};
constexpr std::array accelerations{Unit{"m/s2", 1, 1}, Unit{"m/s^2", 1, 1}, Unit{"g", 9.80665, 1}};
constexpr std::array angles{Unit{"rad", 1, 1}, Unit{"deg", pi, 180}, Unit{"mrad", 1, 1000}};
constexpr std::array angular_rates{Unit{"rad/s", 1, 1}, Unit{"deg/s", pi, 180}, Unit{"rpm", pi, 30}};
constexpr std::array durations{Unit{"s", 1, 1, 1'000'000'000}, Unit{"ms", 1, 1e3, 1'000'000},
                               Unit{"us", 1, 1e6, 1'000}, Unit{"ns", 1, 1e9, 1},
                               Unit{"min", 60, 1, 60'000'000'000}};
constexpr std::array frequencies{Unit{"Hz", 1, 1}, Unit{"kHz", 1000, 1}, Unit{"MHz", 1e6, 1}};
constexpr std::array masses{Unit{"kg", 1, 1}, Unit{"t", 1000, 1}, Unit{"g", 1, 1000}};
constexpr std::array forces{Unit{"N", 1, 1}, Unit{"kN", 1000, 1}, Unit{"mN", 1, 1000}};
constexpr std::array torques{Unit{"N m", 1, 1}, Unit{"kN m", 1000, 1}, Unit{"mN m", 1, 1000}};
constexpr std::array inertias{Unit{"kg m2", 1, 1}, Unit{"kg m^2", 1, 1}, Unit{"t m2", 1000, 1}};
constexpr std::array stiffnesses{Unit{"N/m", 1, 1}, Unit{"kN/m", 1000, 1}, Unit{"MN/m", 1e6, 1}};
constexpr std::array dampings{Unit{"N s/m", 1, 1}, Unit{"kN s/m", 1000, 1}, Unit{"MN s/m", 1e6, 1}};
constexpr std::array illuminances{Unit{"lx", 1, 1}, Unit{"klx", 1000, 1}};
constexpr std::array luminous_intensities{Unit{"cd", 1, 1}, Unit{"kcd", 1000, 1}};
constexpr std::array luminances{Unit{"cd/m2", 1, 1}, Unit{"cd/m^2", 1, 1}, Unit{"kcd/m2", 1000, 1}};
constexpr std::array shares{Unit{"%", 1, 100}};
constexpr std::array data_sizes{Unit{"B", 1, 1}, Unit{"KiB", 0x1p10, 1}, Unit{"MiB", 0x1p20, 1},
                                Unit{"GiB", 0x1p30, 1}, Unit{"TiB", 0x1p40, 1}};

std::string written_in(Quantity quantity) {
  return std::string(name_with_article(quantity)) + " is written in " + unit_list(quantity);
}

bool is_unit(std::string_view symbol) {
  for (std::uint8_t i = 0; i <= static_cast<std::uint8_t>(Quantity::data_bytes); ++i) {
    for (const Unit& unit : units_of(static_cast<Quantity>(i))) {
      if (unit.symbol == symbol) return true;
    }
  }
  return false;
}

std::string wrong_unit(std::string_view symbol, Quantity quantity) {
  std::vector<std::string> known;
  for (const Unit& unit : units_of(quantity))
    known.emplace_back(unit.symbol);
  // A unit of another quantity gets no suggestion.
  const std::string near = is_unit(symbol) ? "" : nearest(symbol, known);
  const std::string hint = near.empty() ? "" : "; did you mean " + in_quotes(near) + "?";
  return "has the unit " + in_quotes(symbol) + ", but " + written_in(quantity) + hint;
}

}  // namespace

std::span<const Unit> units_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::length_m:
      return lengths;
    case Quantity::speed_mps:
      return speeds;
    case Quantity::acceleration_mps2:
      return accelerations;
    case Quantity::angle_rad:
      return angles;
    case Quantity::angular_rate_radps:
      return angular_rates;
    case Quantity::duration_s:
      return durations;
    case Quantity::frequency_hz:
      return frequencies;
    case Quantity::mass_kg:
      return masses;
    case Quantity::force_n:
      return forces;
    case Quantity::torque_nm:
      return torques;
    case Quantity::inertia_kgm2:
      return inertias;
    case Quantity::stiffness_npm:
      return stiffnesses;
    case Quantity::damping_nspm:
      return dampings;
    case Quantity::illuminance_lx:
      return illuminances;
    case Quantity::luminous_intensity_cd:
      return luminous_intensities;
    case Quantity::luminance_cdpm2:
      return luminances;
    case Quantity::share:
      return shares;
    case Quantity::data_bytes:
      return data_sizes;
  }
  stop_on_misuse("a quantity of the list");
}

std::string_view name_with_article(Quantity quantity) {
  switch (quantity) {
    case Quantity::length_m:
      return "a length";
    case Quantity::speed_mps:
      return "a speed";
    case Quantity::acceleration_mps2:
      return "an acceleration";
    case Quantity::angle_rad:
      return "an angle";
    case Quantity::angular_rate_radps:
      return "an angular rate";
    case Quantity::duration_s:
      return "a duration";
    case Quantity::frequency_hz:
      return "a frequency";
    case Quantity::mass_kg:
      return "a mass";
    case Quantity::force_n:
      return "a force";
    case Quantity::torque_nm:
      return "a torque";
    case Quantity::inertia_kgm2:
      return "a moment of inertia";
    case Quantity::stiffness_npm:
      return "a stiffness";
    case Quantity::damping_nspm:
      return "a damping coefficient";
    case Quantity::illuminance_lx:
      return "an illuminance";
    case Quantity::luminous_intensity_cd:
      return "a luminous intensity";
    case Quantity::luminance_cdpm2:
      return "a luminance";
    case Quantity::share:
      return "a share";
    case Quantity::data_bytes:
      return "a size of data";
  }
  stop_on_misuse("a quantity of the list");
}

std::string unit_list(Quantity quantity) {
  std::string list;
  for (const Unit& unit : units_of(quantity))
    list += (list.empty() ? "" : ", ") + std::string(unit.symbol);
  return list;
}

QuantityReading read_quantity(std::string_view text, Quantity quantity) {
  QuantityReading reading;
  text = trimmed(text);
  const ParsedNumber number = read_number(text);
  if (number.length == 0) {
    reading.fault = number.fault + " with a unit; " + written_in(quantity);
    return reading;
  }
  if (!number.fault.empty()) {
    reading.fault = number.fault;
    return reading;
  }
  const std::string_view symbol = trimmed(text.substr(number.length));
  if (symbol.empty()) {
    reading.fault = "has no unit; " + written_in(quantity);
    return reading;
  }
  const std::span<const Unit> units = units_of(quantity);
  const auto unit =
      std::find_if(units.begin(), units.end(), [&](const Unit& known) { return known.symbol == symbol; });
  if (unit == units.end()) {
    reading.fault = wrong_unit(symbol, quantity);
    return reading;
  }
  reading.unit = &*unit;
  reading.value_si = number.value * unit->numerator / unit->denominator;
  if (!std::isfinite(reading.value_si)) {
    reading.fault = "is too large to be held";
    return reading;
  }
  if (quantity == Quantity::duration_s) {
    const std::optional<std::int64_t> nanoseconds =
        multiply_exactly(text.substr(0, number.length), unit->nanoseconds);
    if (!nanoseconds) {
      reading.fault = "is longer than 64 bits of nanoseconds can hold (292 years)";
      return reading;
    }
    reading.nanoseconds = *nanoseconds;
    reading.value_si = static_cast<double>(*nanoseconds) / 1e9;
  }
  return reading;
}

std::string format_quantity(double value_si, const Unit& unit) {
  return format_number(value_si * unit.denominator / unit.numerator) + " " + std::string(unit.symbol);
}

std::string format_limit(double value_si, Quantity quantity, const Unit& unit) {
  if (quantity != Quantity::data_bytes) return format_quantity(value_si, unit);
  constexpr int all_digits = 16;
  const Unit* shown = data_sizes.data();
  for (const Unit& larger : data_sizes)
    if (value_si != 0.0 && std::fmod(value_si, larger.numerator) == 0.0) shown = &larger;
  return format_number(value_si / shown->numerator, all_digits) + " " + std::string(shown->symbol);
}

std::string format_duration(std::int64_t nanoseconds) {
  const auto value = static_cast<double>(nanoseconds);
  if (nanoseconds == 0) return "0 ms";
  if (nanoseconds % 1'000'000'000 == 0) return format_number(value / 1e9) + " s";
  if (std::abs(nanoseconds) >= 1'000'000) return format_number(value / 1e6) + " ms";
  return std::abs(nanoseconds) >= 1'000 ? format_number(value / 1e3) + " us" : format_number(value) + " ns";
}

}  // namespace hil::config
