#pragma once
// Units of measure, as signals have them and expressions write them, and the conversion between units of one
// dimension.
//
// A unit is a product of symbols with exponents: "m/s", "km/h", "kg m2", "1/min", "N m", "m/s^2", "m s-2",
// "kWh". After a "/" the symbols up to the next one are in the denominator. Symbols have the prefixes of the
// SI. Angles and shares are numbers of dimension 1: the radian is 1, the degree pi / 180, % is 1/100. "degC"
// and "degF" (with a degree sign too) have an offset where they stand alone, and are differences in products.
// "g" is the gram; the standard acceleration of gravity is "gn".
//
// Threads: pure functions.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hil::units {

/// Exponents of metre, kilogram, second, ampere, kelvin, mole and candela.
struct Dimension {
  std::array<std::int8_t, 7> exponents{};
  bool operator==(const Dimension&) const = default;
  bool is_one() const noexcept { return *this == Dimension{}; }
};

/// Empty: an exponent is beyond 100.
std::optional<Dimension> product(const Dimension& a, const Dimension& b) noexcept;
std::optional<Dimension> power(const Dimension& dimension, int exponent) noexcept;
/// Empty: an exponent is odd.
std::optional<Dimension> square_root(const Dimension& dimension) noexcept;

/// The unit of the SI with this dimension: "m/s", "kg m2/s3"; "1" of dimension 1.
std::string si_symbol(const Dimension& dimension);

/// A value in the unit is value * numerator / denominator + offset in the SI.
struct Unit {
  std::string symbol;  ///< as it was written
  Dimension dimension;
  double numerator = 1.0, denominator = 1.0;
  double offset = 0.0;

  double to_si(double value) const noexcept { return value * numerator / denominator + offset; }
  double from_si(double value) const noexcept { return (value - offset) * denominator / numerator; }
  /// The same for a difference of two values.
  double difference_to_si(double value) const noexcept { return value * numerator / denominator; }
};

/// The unit of differences of values in a unit: K where it has an offset, else the unit itself.
struct DifferenceUnit {
  std::string symbol;
  double factor = 1.0;  ///< a difference in it, times the factor, is one of values in the unit
};
/// `symbol` may be no unit.
DifferenceUnit difference_unit(const std::string& symbol);

/// "", "-" and "1" are the unit of plain numbers. Empty: the text is no unit, or has an exponent beyond 100.
std::optional<Unit> parse_unit(std::string_view text);

/// Converts values of one unit to another: value * numerator / denominator + offset.
struct Conversion {
  double numerator = 1.0, denominator = 1.0, offset = 0.0;
  double of(double value) const noexcept {
    const double scaled = value * numerator / denominator;
    return offset == 0.0 ? scaled : scaled + offset;  // -0 stays -0
  }
  bool is_identity() const noexcept { return numerator == denominator && offset == 0.0; }
};

/// Empty: the dimensions differ.
std::optional<Conversion> conversion(const Unit& from, const Unit& to);

}  // namespace hil::units
