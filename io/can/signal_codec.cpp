#include "io/can/signal_codec.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "io/can/assertion.hpp"

namespace hil::io::can {

namespace {

constexpr std::size_t max_bits = 512;

/// Position of a Motorola signal's most significant bit when bits are counted from the first byte's bit 7 on.
std::size_t big_endian_position(std::uint16_t start_bit) {
  return 8U * (start_bit / 8U) + (7U - start_bit % 8U);
}

}  // namespace

bool bits_of(const DbcSignal& signal, PayloadBits& bits) {
  for (std::size_t index = 0; index < signal.length_bits; ++index) {
    std::size_t bit = signal.start_bit + index;
    if (signal.order == ByteOrder::motorola) {
      const std::size_t position = big_endian_position(signal.start_bit) + index;
      bit = 8 * (position / 8) + (7 - position % 8);
    }
    if (bit >= max_bits) return false;
    bits.set(bit);
  }
  return true;
}

std::optional<double> raw_number(const DbcSignal& signal, double raw) noexcept {
  if (!std::isfinite(raw)) return std::nullopt;
  if (signal.type == ValueType::float32 || signal.type == ValueType::float64) return raw;
  const bool is_signed = signal.type == ValueType::signed_integer;
  const double all = std::ldexp(1.0, signal.length_bits);
  const double lowest = is_signed ? -all / 2 : 0.0;
  const double highest = is_signed ? all / 2 : all;  // the first number above the range
  if (raw != std::trunc(raw)) return std::nullopt;
  // The number is written as the unsigned, or the signed, number with the same bits.
  if (is_signed && raw >= highest && raw < all) return raw - all;
  if (!is_signed && signal.length_bits == 64 && raw < 0.0 && raw >= -all / 2) return raw + all;
  return raw >= lowest && raw < highest ? std::optional(raw) : std::nullopt;
}

SignalCodec::SignalCodec(const DbcSignal& signal)
    : type_(signal.type),
      length_bits_(signal.length_bits),
      factor_(signal.factor),
      offset_(signal.offset),
      mask_(signal.length_bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << signal.length_bits) - 1) {
  PayloadBits bits;
  require(signal.length_bits >= 1 && signal.length_bits <= 64 && bits_of(signal, bits) && signal.fits,
          "a coded signal fits in its message");
  if (signal.order == ByteOrder::intel) {
    low_byte_ = signal.start_bit / 8;
    shift_ = signal.start_bit % 8U;
    step_ = 1;
  } else {
    const std::size_t last = big_endian_position(signal.start_bit) + signal.length_bits - 1;
    low_byte_ = static_cast<int>(last / 8);
    shift_ = static_cast<unsigned>(7 - last % 8);
    step_ = -1;
  }
  byte_count_ = static_cast<int>((shift_ + signal.length_bits + 7) / 8);
  needed_bytes_ = static_cast<std::size_t>(std::max(low_byte_, low_byte_ + step_ * (byte_count_ - 1))) + 1;

  if (is_floating()) {
    const double largest = type_ == ValueType::float32
                               ? static_cast<double>(std::numeric_limits<float>::max())
                               : std::numeric_limits<double>::max();
    lowest_ = signal.has_range() ? signal.minimum : -largest;
    highest_ = signal.has_range() ? signal.maximum : largest;
  } else {
    set_integer_limits(signal);
    set_named_numbers(signal);
  }
}

void SignalCodec::set_integer_limits(const DbcSignal& signal) {
  const bool is_signed = type_ == ValueType::signed_integer;
  // The largest double that does not exceed the largest raw value; the raw value itself is stored separately.
  const unsigned value_bits = length_bits_ - (is_signed ? 1U : 0U);
  const double limit = std::ldexp(1.0, static_cast<int>(value_bits));
  highest_ = value_bits > 53 ? std::nextafter(limit, 0.0) : limit - 1.0;
  highest_raw_ = is_signed ? mask_ >> 1U : mask_;
  lowest_ = is_signed ? -limit : 0.0;
  lowest_raw_ = is_signed ? (mask_ >> 1U) + 1 : 0;
  if (!signal.has_range()) return;

  double low = (signal.minimum - offset_) / factor_;
  double high = (signal.maximum - offset_) / factor_;
  if (low > high) std::swap(low, high);
  // Decimal fractions are not exact in binary: a limit that misses a raw value only by rounding denotes that
  // value.
  low = std::ceil(low - 1e-9 * std::max(1.0, std::abs(low)));
  high = std::floor(high + 1e-9 * std::max(1.0, std::abs(high)));
  // Ignores a range outside of the representable values
  if (low > high || low > highest_ || high < lowest_) return;
  if (low > lowest_) {
    lowest_ = low;
    lowest_raw_ = integer_raw(low);
  }
  if (high < highest_) {
    highest_ = high;
    highest_raw_ = integer_raw(high);
  }
}

void SignalCodec::set_named_numbers(const DbcSignal& signal) {
  const auto add = [&](double raw) {
    const std::optional<double> number = raw_number(signal, raw);
    if (number && (*number < lowest_ || *number > highest_) && *number < 0x1p64)
      named_numbers_.push_back(*number);
  };
  for (const auto& [raw, name] : signal.value_names)
    add(static_cast<double>(raw));
  if (signal.start_raw) add(*signal.start_raw);
  std::sort(named_numbers_.begin(), named_numbers_.end());
}

std::uint64_t SignalCodec::integer_raw(double rounded) const noexcept {
  if (type_ == ValueType::signed_integer)
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded)) & mask_;
  return static_cast<std::uint64_t>(rounded);
}

SignalCodec::Encoded SignalCodec::to_raw(double physical) const noexcept {
  if (std::isnan(physical)) return {0, Verdict::refused};
  if (is_floating()) {
    const double clamped = std::clamp(physical, lowest_, highest_);
    const double scaled = (clamped - offset_) / factor_;
    const Verdict verdict = clamped == physical ? Verdict::taken : Verdict::saturated;
    if (type_ == ValueType::float64) return {std::bit_cast<std::uint64_t>(scaled), verdict};
    const double largest = static_cast<double>(std::numeric_limits<float>::max());
    const auto narrow = static_cast<float>(std::clamp(scaled, -largest, largest));
    return {std::bit_cast<std::uint32_t>(narrow), verdict};
  }
  const double rounded = std::round((physical - offset_) / factor_);
  if (std::binary_search(named_numbers_.begin(), named_numbers_.end(), rounded))
    return {integer_raw(rounded), Verdict::taken};
  if (rounded > highest_) return {highest_raw_, Verdict::saturated};
  if (rounded < lowest_) return {lowest_raw_, Verdict::saturated};
  return {integer_raw(rounded), Verdict::taken};
}

double SignalCodec::to_physical(std::uint64_t raw) const noexcept {
  double value = 0.0;
  switch (type_) {
    case ValueType::unsigned_integer:
      value = static_cast<double>(raw & mask_);
      break;
    case ValueType::signed_integer: {
      const unsigned unused = 64U - length_bits_;
      value = static_cast<double>(static_cast<std::int64_t>(raw << unused) >> unused);
      break;
    }
    case ValueType::float32:
      value = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
      break;
    case ValueType::float64:
      value = std::bit_cast<double>(raw);
      break;
  }
  return value * factor_ + offset_;
}

double SignalCodec::physical_minimum() const noexcept {
  if (is_floating()) return lowest_;
  return std::min(lowest_ * factor_ + offset_, highest_ * factor_ + offset_);
}

double SignalCodec::physical_maximum() const noexcept {
  if (is_floating()) return highest_;
  return std::max(lowest_ * factor_ + offset_, highest_ * factor_ + offset_);
}

std::uint64_t SignalCodec::extract(std::span<const std::uint8_t> payload) const noexcept {
  require(payload.size() >= needed_bytes_, "the payload holds the signal");
  std::uint64_t raw = payload[byte_at(0)] >> shift_;
  for (int index = 1; index < byte_count_; ++index) {
    const std::uint64_t byte = payload[byte_at(index)];
    raw |= byte << (8U * static_cast<unsigned>(index) - shift_);
  }
  return raw & mask_;
}

void SignalCodec::insert(std::span<std::uint8_t> payload, std::uint64_t raw) const noexcept {
  require(payload.size() >= needed_bytes_, "the payload holds the signal");
  for (int index = 0; index < byte_count_; ++index) {
    std::uint8_t& byte = payload[byte_at(index)];
    const unsigned up = 8U * static_cast<unsigned>(index);
    const auto place = [&](std::uint64_t bits) {
      return static_cast<std::uint8_t>(index == 0 ? bits << shift_ : bits >> (up - shift_));
    };
    byte = static_cast<std::uint8_t>((byte & ~place(mask_)) | place(raw & mask_));
  }
}

}  // namespace hil::io::can
