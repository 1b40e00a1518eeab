#include "runtime/config/reading.hpp"

#include <cmath>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>

namespace hil::config {
namespace {

/// The tolerance for a rate that divides the base rate: decimals of 1 kHz / 30 do not end.
constexpr double relative_tolerance = 1e-9;

std::string format_frequency(double hz) {
  return hz >= 1000.0 ? format_number(hz / 1000.0) + " kHz" : format_number(hz) + " Hz";
}

}  // namespace

void UniqueNames::add(const Word& name) {
  const auto [first, is_new] = first_.try_emplace(name.text, name.place);
  if (is_new) return;
  const Place& place = first->second;
  const std::string file = place.file == name.place.file ? "" : " of " + place.file;
  diagnostics_.add(name.place, "the " + what_ + " " + in_quotes(name.text) +
                                   " is given twice; first in line " + std::to_string(place.line) + file);
}

Word word_of(const Value& text) {
  return {text.text(), text.place()};
}

std::optional<Word> word_in(const Value& record, const std::string& field) {
  if (!record.has(field)) return std::nullopt;
  return word_of(record[field]);
}

std::array<double, 3> three_numbers(const Value& list) {
  return {list.items()[0].number(), list.items()[1].number(), list.items()[2].number()};
}

const Value* part_of(const Value& record, const std::string& field) {
  return record.has(field) ? &record[field] : nullptr;
}

std::optional<std::uint32_t> ticks_between(const Value& rate, const ReaderContext& reading) {
  if (!reading.base) return std::nullopt;
  const double base_hz = reading.base->hz;
  const double ratio = base_hz / rate.number();
  const double ticks = std::round(ratio);
  const std::string written = "'rate': " + format_frequency(rate.number());
  if (ratio < 1.0 - relative_tolerance) {
    reading.diagnostics.add(rate.place(),
                            written + " is above the base rate of " + format_frequency(base_hz));
    return std::nullopt;
  }
  if (ticks > 4e9) {
    reading.diagnostics.add(rate.place(), written + " is too slow for the base rate of " +
                                              format_frequency(base_hz) +
                                              "; at most 4000000000 ticks can lie between two runs");
    return std::nullopt;
  }
  if (std::abs(ratio - ticks) <= relative_tolerance * ticks) return static_cast<std::uint32_t>(ticks);
  const auto divided = [&](double by) {
    return format_frequency(base_hz / by) + " (" + format_frequency(base_hz) + " / " + format_number(by) +
           ")";
  };
  const double fewer = std::floor(ratio);
  reading.diagnostics.add(rate.place(), written + " does not divide the base rate; the nearest that do are " +
                                            divided(fewer) + " and " + divided(fewer + 1.0));
  return std::nullopt;
}

std::optional<std::int64_t> multiple_of(const Value& duration, std::int64_t unit_ns, const std::string& field,
                                        const std::string& unit_name, Diagnostics& diagnostics) {
  const std::int64_t nanoseconds = duration.duration_ns();
  if (nanoseconds % unit_ns == 0) return nanoseconds / unit_ns;
  const std::int64_t below = nanoseconds / unit_ns * unit_ns;
  diagnostics.add(duration.place(), in_quotes(field) + ": " + format_duration(nanoseconds) +
                                        " is no multiple of " + unit_name + " of " +
                                        format_duration(unit_ns) + "; the nearest are " +
                                        format_duration(below) + " and " + format_duration(below + unit_ns));
  return std::nullopt;
}

}  // namespace hil::config
