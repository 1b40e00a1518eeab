#pragma once
// Numbers for human readers: with a unit and the significant digits. Typographic (µ, a minus sign, narrow
// spaces between thousands); to_ascii converts them for consoles.

#include <cstdint>
#include <string>

namespace hil::report {

/// Shown for an unknown value.
inline constexpr const char* dash = "\u2013";

/// A measured time: three significant digits, in a suitable unit. 412345 -> "412 µs", 8000000 -> "8.00
/// ms", 0 -> "0".
std::string measured_time(std::int64_t ns);

/// A configured time: all its digits. 8000000 -> "8 ms", 1500000 -> "1.5 ms", 0 -> "0".
std::string chosen_time(std::int64_t ns);

/// An instant of the run in seconds with milliseconds: "4.217 s".
std::string instant(std::int64_t ns);

/// 12345678 -> "12 345 678".
std::string count_text(std::uint64_t count);

/// Sixteen hexadecimal digits.
std::string id_text(std::uint64_t id);

/// Three significant digits: 1536 -> "1.54 kB", 4096 -> "4.10 kB", 12 -> "12 B".
std::string bytes_text(std::uint64_t bytes);

/// 1000 -> "1 kHz", 2.5 -> "2.5 Hz".
std::string rate_text(double hz);

/// With `decimals` decimals. Not finite: a dash.
std::string decimal(double value, int decimals);

/// Up to four significant digits and the unit: "0.125 m", "-12.5 ms" of -0.0125 s, "3" of a plain number. Not
/// finite: a dash.
std::string quantity_text(double value, const std::string& unit);

/// The shortest text that reads back as the same number. Not finite: a dash.
std::string shortest(double value);

/// 0.125 -> "12.5 %". Not finite: a dash.
std::string percent(double fraction, int decimals = 1);

/// "1 miss", "2 misses".
std::string counted(std::uint64_t count, const char* one, const char* many);

std::string to_ascii(std::string text);

}  // namespace hil::report
