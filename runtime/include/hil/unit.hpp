#pragma once
// Units of measure, as signals have them and expressions write them, and the conversion between units of one
// dimension.
//
// A unit is a product of symbols with exponents: "m/s", "km/h", "kg m2", "1/min", "N m", "m/s^2", "m s-2",
// "kWh". After a "/" the symbols up to the next one are in the denominator. A number before a symbol is a
// factor: "10mV", "l/100km". Symbols have the prefixes of the SI, rad those below 1: "Grad" is the German
// name of the degree. Angles and shares are numbers of dimension 1: the radian is 1, the degree pi / 180, the
// turn (rev) 2 pi, % is 1/100. "degC" and "degF" (with a degree
// sign too) have an offset where they stand alone, and are differences in products. "g" is the gram; the
// standard acceleration of gravity is "gn".
//
// Rates. A value per time counts radians (rad/s, deg/s), turns (rpm, rev/min) or cycles (Hz, 1/s, 1/min).
// Turns convert to both others: 1 rpm is 1 1/min and 2 pi rad/min. Radians and cycles do not convert.
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

/// Whether it is a number per time, or per a power of time.
bool is_rate(const Dimension& dimension) noexcept;

/// The unit of the SI with this dimension: "m/s", "kg m2/s3"; "1" of dimension 1.
std::string si_symbol(const Dimension& dimension);

/// The angle in a unit or in a computed value. In the SI an angle is in radians, so a turn is 2 pi.
struct Angle {
  std::int8_t exponent = 0;  ///< 1 of rad/s and rpm, -1 of N m/rad
  bool in_turns = false;     ///< of rev and rpm; only with an exponent
  /// Computed from other units, as v / r: without an angle, a rate may count radians or cycles.
  bool is_open = false;
  bool is_cycles = false;  ///< a number of cycles, of a frequency times a time; without an exponent
};

/// What kind of value is in the unit, where its symbol does not tell.
enum class ValueKind : std::uint8_t {
  as_unit,     ///< its symbol tells
  open,        ///< computed: in 1/s it may count radians or cycles; in K it may be a temperature or a
               ///< difference; without a unit it is a number of cycles
  difference,  ///< of two temperatures
};

/// Converts values of one unit to another: value * numerator / denominator + offset.
struct Conversion {
  double numerator = 1.0, denominator = 1.0, offset = 0.0;
  double of(double value) const noexcept {
    const double scaled = value * numerator / denominator;
    return offset == 0.0 ? scaled : scaled + offset;  // -0 stays -0
  }
  bool is_identity() const noexcept { return numerator == denominator && offset == 0.0; }
};

/// A value in the unit is value * (2 pi)^two_pi_exponent * numerator / denominator + offset in the SI.
struct Unit {
  std::string symbol;  ///< as it was written
  Dimension dimension;
  double numerator = 1.0, denominator = 1.0;
  double offset = 0.0;
  std::int8_t two_pi_exponent = 0;
  Angle angle{};

  Conversion to_si() const noexcept;
  /// Converts a difference of two values to the SI.
  Conversion difference_to_si() const noexcept;
  double to_si(double value) const noexcept { return to_si().of(value); }
};
/// Whether its values are those in the SI.
bool is_si(const Unit& unit) noexcept;
/// Whether values in both units are the same numbers of the same kind.
bool is_same(const Unit& a, const Unit& b) noexcept;

/// The unit of differences of values in a unit: K where it has an offset, else the unit itself.
struct DifferenceUnit {
  std::string symbol;
  double factor = 1.0;  ///< a difference in it, times the factor, is one of values in the unit
};
/// `symbol` may be no unit.
DifferenceUnit difference_unit(const std::string& symbol);

/// "", "-" and "1" are the unit of plain numbers. Empty: the text is no unit, or has an exponent beyond 100.
std::optional<Unit> parse_unit(std::string_view text);

/// Empty: the dimensions differ, or one counts radians and the other one cycles.
std::optional<Conversion> conversion(const Unit& from, const Unit& to);
/// The exponent of 2 pi by which a value with the angle `from` is multiplied to be one with the angle `to`,
/// both in the SI. Empty: they do not convert. Rates follow the rule of the file comment. In other dimensions
/// an angle in radians may be left out, and one in turns may not. A number of cycles is no angle.
std::optional<int> two_pi_exponent_between(const Dimension& dimension, const Angle& from,
                                           const Angle& to) noexcept;

/// The angle of values of this kind.
Angle angle_of(const Unit& unit, ValueKind value_kind) noexcept;
/// How the value of a signal is converted for its reader, by their units. Without a unit ("") a value is in
/// the SI. Two texts that are alike, and a unit that is none beside "", convert nothing. Empty: the units are
/// of different kinds, one is unknown, one is "" and the other one counts turns, or a difference of
/// temperatures is read on a scale that does not begin at 0 K.
std::optional<Conversion> signal_conversion(const std::string& from, const std::string& to,
                                            ValueKind value_kind = ValueKind::as_unit);
/// That a signal without a unit is read beside one in the unit: "'x' has no unit, ...".
std::string missing_unit_text(const std::string& signal, const Unit& unit);
/// Why two known units of one dimension do not convert, and what to write: "; ...". "" where they do.
std::string angle_hint(const Dimension& dimension, const Angle& from, const Angle& to);

}  // namespace hil::units
