#include "runtime/report/quantities.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

namespace hil::report {
namespace {

constexpr std::string_view minus = "\u2212";
constexpr std::string_view thousands = "\u202F";

struct Unit {
  std::uint64_t ns;
  std::string_view symbol;
};
constexpr std::array units{Unit{1, " ns"}, Unit{1'000, " µs"}, Unit{1'000'000, " ms"},
                           Unit{1'000'000'000, " s"}};

std::uint64_t magnitude(std::int64_t value) {
  const auto bits = static_cast<std::uint64_t>(value);
  return value < 0 ? ~bits + 1 : bits;
}

/// Digits of `value` divided by 10^decimals.
std::string with_point(std::uint64_t value, std::uint64_t scale, int decimals) {
  std::string text = count_text(value / scale);
  if (decimals == 0) return text;
  std::string fraction = std::to_string(value % scale);
  fraction.insert(0, static_cast<std::size_t>(decimals) - fraction.size(), '0');
  return text + '.' + fraction;
}

std::uint64_t rounded_quotient(std::uint64_t value, std::uint64_t quantum) {
  return value / quantum + (value % quantum >= quantum - quantum / 2 ? 1 : 0);
}

/// The decimal point and sign as printed; the shape of std::to_chars.
std::string typeset(std::string_view plain) {
  if (plain.starts_with('-')) return std::string(minus) + std::string(plain.substr(1));
  return std::string(plain);
}

template <class... Format>
std::string printed(double value, Format... format) {
  if (!std::isfinite(value)) return dash;
  std::array<char, 400> buffer{};  // a double in fixed form has at most 309 digits before its point
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format...);
  const std::string_view plain(buffer.data(), static_cast<std::size_t>(end.ptr - buffer.data()));
  const bool zero = plain.find_first_of("123456789") == std::string_view::npos;
  return typeset(zero && plain.starts_with('-') ? plain.substr(1) : plain);
}

}  // namespace

std::string measured_time(std::int64_t ns) {
  if (ns == 0) return "0";
  const std::string sign = ns < 0 ? std::string(minus) : "";
  const std::uint64_t value = magnitude(ns);
  if (value < 1'000) return sign + count_text(value) + std::string(units[0].symbol);
  for (std::size_t index = 1; index < units.size(); ++index) {
    // The first form whose digits, after rounding, are three at most.
    for (const auto& [decimals, scale] : {std::pair{2, 100U}, std::pair{1, 10U}, std::pair{0, 1U}}) {
      const std::uint64_t rounded = rounded_quotient(value, units[index].ns / scale);
      if (rounded < 1'000)
        return sign + with_point(rounded, scale, decimals) + std::string(units[index].symbol);
    }
  }
  return sign + count_text(rounded_quotient(value, units.back().ns)) + std::string(units.back().symbol);
}

std::string chosen_time(std::int64_t ns) {
  if (ns == 0) return "0";
  const std::uint64_t value = magnitude(ns);
  const auto& unit =
      *std::find_if(units.rbegin(), units.rend(), [&](const Unit& u) { return value >= u.ns; });
  std::string fraction = std::to_string(unit.ns + value % unit.ns).substr(1);
  fraction.erase(fraction.find_last_not_of('0') + 1);
  return (ns < 0 ? std::string(minus) : "") + count_text(value / unit.ns) +
         (fraction.empty() ? "" : "." + fraction) + std::string(unit.symbol);
}

std::string instant(std::int64_t ns) {
  const std::uint64_t milliseconds = magnitude(ns) / 1'000'000;
  return (ns < 0 && milliseconds > 0 ? std::string(minus) : "") + with_point(milliseconds, 1'000, 3) + " s";
}

std::string count_text(std::uint64_t count) {
  std::string digits = std::to_string(count);
  for (std::size_t at = digits.size(); at > 3;) {
    at -= 3;
    digits.insert(at, thousands);
  }
  return digits;
}

std::string id_text(std::uint64_t id) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(id));
  return text.data();
}

std::string bytes_text(std::uint64_t bytes) {
  if (bytes < 1'000) return std::to_string(bytes) + " B";
  constexpr std::array<const char*, 6> larger{" kB", " MB", " GB", " TB", " PB", " EB"};
  double value = static_cast<double>(bytes) / 1e3;
  std::size_t index = 0;
  for (; value >= 999.5; ++index)
    value /= 1e3;
  return decimal(value, value < 9.995 ? 2 : value < 99.95 ? 1 : 0) + larger[index];
}

std::string rate_text(double hz) {
  if (!std::isfinite(hz)) return dash;
  return hz >= 1'000.0 ? shortest(hz / 1'000.0) + " kHz" : shortest(hz) + " Hz";
}

std::string decimal(double value, int decimals) {
  return printed(value, std::chars_format::fixed, decimals);
}

std::string quantity_text(double value, const std::string& unit) {
  if (!std::isfinite(value)) return dash;
  if (unit == "s" && std::abs(value) < 1e9)
    return measured_time(static_cast<std::int64_t>(std::llround(1e9 * value)));
  const std::string number = printed(value, std::chars_format::general, 4);
  return unit.empty() ? number : number + ' ' + unit;
}

std::string shortest(double value) {
  return printed(value);
}

std::string percent(double fraction, int decimals) {
  return std::isfinite(fraction) ? decimal(fraction * 100.0, decimals) + " %" : dash;
}

std::string counted(std::uint64_t count, const char* one, const char* many) {
  return count_text(count) + ' ' + (count == 1 ? one : many);
}

std::string to_ascii(std::string text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> spellings{
      {{minus, "-"}, {thousands, ""}, {"µ", "u"}, {dash, "-"}}};
  for (const auto& [from, to] : spellings) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
  }
  return text;
}

}  // namespace hil::report
