#include "io/modbus/register_codec.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "io/modbus/require.hpp"

namespace hil::io::modbus {

namespace {

struct Raw {
  std::uint64_t bits = 0;  ///< the value's bits, in the low end
  bool saturated = false;
};

/// `Integer` nearest to `raw`, which is not NaN. The upper bound is compared as 2^n, which a double holds
/// exactly.
template <class Integer>
Raw to_integer(double raw) noexcept {
  const double rounded = std::nearbyint(raw);
  const double beyond = std::ldexp(1.0, std::numeric_limits<Integer>::digits);
  if (rounded >= beyond) return {static_cast<std::uint64_t>(std::numeric_limits<Integer>::max()), true};
  if (rounded < static_cast<double>(std::numeric_limits<Integer>::min())) {
    return {static_cast<std::uint64_t>(std::numeric_limits<Integer>::min()), true};
  }
  return {static_cast<std::uint64_t>(static_cast<Integer>(rounded)), false};
}

Raw to_f32(double raw) noexcept {
  constexpr double largest = std::numeric_limits<float>::max();
  const double kept = std::clamp(raw, -largest, largest);
  return {std::bit_cast<std::uint32_t>(static_cast<float>(kept)), kept != raw};
}

Raw to_f64(double raw) noexcept {
  constexpr double largest = std::numeric_limits<double>::max();
  const double kept = std::clamp(raw, -largest, largest);
  return {std::bit_cast<std::uint64_t>(kept), kept != raw};
}

Raw to_raw(ValueType type, double raw) noexcept {
  switch (type) {
    case ValueType::boolean:
      return {raw != 0.0 ? std::uint64_t{1} : std::uint64_t{0}, false};
    case ValueType::u16:
      return to_integer<std::uint16_t>(raw);
    case ValueType::i16:
      return to_integer<std::int16_t>(raw);
    case ValueType::u32:
      return to_integer<std::uint32_t>(raw);
    case ValueType::i32:
      return to_integer<std::int32_t>(raw);
    case ValueType::u64:
      return to_integer<std::uint64_t>(raw);
    case ValueType::i64:
      return to_integer<std::int64_t>(raw);
    case ValueType::f32:
      return to_f32(raw);
    case ValueType::f64:
      return to_f64(raw);
  }
  return {};
}

template <class Number>
ValueRange range_of_type() noexcept {
  return {static_cast<double>(std::numeric_limits<Number>::lowest()),
          static_cast<double>(std::numeric_limits<Number>::max())};
}

ValueRange raw_range_of(ValueType type) noexcept {
  switch (type) {
    case ValueType::boolean:
      return {0.0, 1.0};
    case ValueType::u16:
      return range_of_type<std::uint16_t>();
    case ValueType::i16:
      return range_of_type<std::int16_t>();
    case ValueType::u32:
      return range_of_type<std::uint32_t>();
    case ValueType::i32:
      return range_of_type<std::int32_t>();
    case ValueType::u64:
      return range_of_type<std::uint64_t>();
    case ValueType::i64:
      return range_of_type<std::int64_t>();
    case ValueType::f32:
      return range_of_type<float>();
    case ValueType::f64:
      return range_of_type<double>();
  }
  return {};
}

double from_raw(ValueType type, std::uint64_t bits) noexcept {
  switch (type) {
    case ValueType::boolean:
      return bits != 0 ? 1.0 : 0.0;
    case ValueType::u16:
    case ValueType::u32:
    case ValueType::u64:
      return static_cast<double>(bits);
    case ValueType::i16:
      return static_cast<std::int16_t>(bits);
    case ValueType::i32:
      return static_cast<std::int32_t>(bits);
    case ValueType::i64:
      return static_cast<double>(static_cast<std::int64_t>(bits));
    case ValueType::f32:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case ValueType::f64:
      return std::bit_cast<double>(bits);
  }
  return 0.0;
}

bool words_reversed(ByteOrder order) noexcept {
  return order == ByteOrder::cdab || order == ByteOrder::dcba;
}
bool bytes_swapped(ByteOrder order) noexcept {
  return order == ByteOrder::badc || order == ByteOrder::dcba;
}

std::uint16_t swapped(std::uint16_t word) noexcept {
  return static_cast<std::uint16_t>(static_cast<unsigned>(word) << 8U | static_cast<unsigned>(word) >> 8U);
}

/// The shift that places register `index` of `width` in the value's bits.
unsigned shift_of(ByteOrder order, std::size_t index, std::size_t width) noexcept {
  const std::size_t from_low_end = words_reversed(order) ? index : width - 1 - index;
  return static_cast<unsigned>(16 * from_low_end);
}

}  // namespace

Conversion encode(const RegisterEntry& entry, double value, std::span<std::uint16_t> registers) noexcept {
  const std::size_t width = width_of(entry.type);
  require(registers.size() >= width, "encode: fewer registers than the type takes");
  if (std::isnan(value)) return Conversion::refused;
  const double bounded = std::min(std::max(value, entry.minimum), entry.maximum);
  const Raw raw = to_raw(entry.type, (bounded - entry.offset) / entry.scale);
  const bool swap = bytes_swapped(entry.order) && entry.type != ValueType::boolean;
  for (std::size_t index = 0; index < width; ++index) {
    const auto word = static_cast<std::uint16_t>(raw.bits >> shift_of(entry.order, index, width));
    registers[index] = swap ? swapped(word) : word;
  }
  return raw.saturated || bounded != value ? Conversion::out_of_range : Conversion::exact;
}

Decoded decode(const RegisterEntry& entry, std::span<const std::uint16_t> registers) noexcept {
  const std::size_t width = width_of(entry.type);
  require(registers.size() >= width, "decode: fewer registers than the type takes");
  const bool swap = bytes_swapped(entry.order) && entry.type != ValueType::boolean;
  std::uint64_t bits = 0;
  for (std::size_t index = 0; index < width; ++index) {
    const std::uint16_t word = swap ? swapped(registers[index]) : registers[index];
    bits |= std::uint64_t{word} << shift_of(entry.order, index, width);
  }
  const double value = from_raw(entry.type, bits) * entry.scale + entry.offset;
  if (!std::isfinite(value)) return {Conversion::refused, value};
  const bool is_in_range = value >= entry.minimum && value <= entry.maximum;
  return {is_in_range ? Conversion::exact : Conversion::out_of_range, value};
}

ValueRange range_of(const RegisterEntry& entry) noexcept {
  const ValueRange raw = raw_range_of(entry.type);
  const double first = raw.lowest * entry.scale + entry.offset;
  const double last = raw.highest * entry.scale + entry.offset;
  return {std::max(std::min(first, last), entry.minimum), std::min(std::max(first, last), entry.maximum)};
}

}  // namespace hil::io::modbus
