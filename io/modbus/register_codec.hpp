#pragma once
// Converts values to registers and back, for one entry of a register map.
//
// Values are doubles, in the entry's unit. 64-bit integers beyond 2^53 are therefore rounded to the nearest
// double. A bit (coil, discrete input) is represented as a register of 0 or 1, so that all tables are handled
// alike.
//
// Threads: free functions, callable from any thread. No allocation.

#include <cstddef>
#include <cstdint>
#include <span>

#include "io/modbus/register_map.hpp"

namespace hil::io::modbus {

/// Registers of the widest type.
inline constexpr std::size_t widest_value = 4;

enum class Conversion : std::uint8_t {
  exact,         ///< the value was representable, after rounding to the nearest raw value
  out_of_range,  ///< outside minimum..maximum or the type: encode writes the nearest limit, decode returns it
  refused,       ///< NaN (encode), or registers that hold NaN or an infinity (decode): nothing was changed
};

/// Writes `value` into registers[0 .. width_of(entry.type)). The raw value is rounded to the nearest, ties to
/// even. A boolean is 1 for every value but 0. Infinities saturate. Misuse (asserts): too few registers.
Conversion encode(const RegisterEntry& entry, double value, std::span<std::uint16_t> registers) noexcept;

struct Decoded {
  Conversion conversion = Conversion::refused;
  double value =
      0.0;  ///< that of the registers: outside the range if out_of_range, NaN or infinite if refused
};

/// The range of values that an entry takes without saturation, from its limits and its type.
struct ValueRange {
  double lowest = 0.0;
  double highest = 0.0;
};
ValueRange range_of(const RegisterEntry& entry) noexcept;

/// The value of registers[0 .. width_of(entry.type)). Misuse (asserts): too few registers.
Decoded decode(const RegisterEntry& entry, std::span<const std::uint16_t> registers) noexcept;

}  // namespace hil::io::modbus
