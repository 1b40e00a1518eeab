#pragma once
// Converts one signal between its physical value and its bits in a payload.
//
// Threads: values, const after construction; any thread. No function allocates.

#include <bitset>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "io/can/dbc.hpp"

namespace hil::io::can {

/// Bit 8 * byte + bit, where bit 0 is a byte's least significant.
using PayloadBits = std::bitset<512>;

/// The bits of a signal. False when one lies beyond the 64 bytes of the longest frame; `bits` is then
/// partial.
bool bits_of(const DbcSignal& signal, PayloadBits& bits);

/// The number that a raw value of the file (GenSigStartValue, VAL_) denotes. A negative number may be written
/// as the unsigned number with the same bits. Empty: the signal can not represent it.
std::optional<double> raw_number(const DbcSignal& signal, double raw) noexcept;

/// The physical value of a raw number.
inline double physical_of(const DbcSignal& signal, double raw_number) noexcept {
  return raw_number * signal.factor + signal.offset;
}

class SignalCodec {
 public:
  /// Misuse (asserts): a signal that does not fit its message.
  explicit SignalCodec(const DbcSignal& signal);

  enum class Verdict : std::uint8_t {
    taken,
    saturated,  ///< out of range (of the bits, or of the DBC's minimum and maximum): the nearest value that
    ///< is in range. Raw values of an integer that have a name, and its start value, are in range.
    refused,  ///< NaN: there is no raw value for it
  };
  struct Encoded {
    std::uint64_t raw = 0;
    Verdict verdict = Verdict::taken;
  };

  /// Rounds to the nearest raw value (halves away from zero), then saturates. The raw value is in the low
  /// bits.
  Encoded to_raw(double physical) const noexcept;
  double to_physical(std::uint64_t raw) const noexcept;

  /// The signal's bits, in the low bits of the result. Misuse (asserts): a payload too short for the signal.
  std::uint64_t extract(std::span<const std::uint8_t> payload) const noexcept;
  /// Sets the signal's bits and no other.
  void insert(std::span<std::uint8_t> payload, std::uint64_t raw) const noexcept;

  double decode(std::span<const std::uint8_t> payload) const noexcept {
    return to_physical(extract(payload));
  }

  /// The physical values that are encoded without saturation lie between these.
  double physical_minimum() const noexcept;
  double physical_maximum() const noexcept;

  std::uint16_t length_bits() const noexcept { return length_bits_; }
  /// Whether a payload of this length contains every bit of the signal.
  bool is_whole_in(std::size_t payload_bytes) const noexcept { return payload_bytes >= needed_bytes_; }
  /// A mask with all bits of the signal.
  std::uint64_t mask() const noexcept { return mask_; }

 private:
  /// The byte that contains the signal's bits from 8 * index - shift_ on.
  std::size_t byte_at(int index) const noexcept {
    const int byte = low_byte_ + step_ * index;
    return static_cast<std::size_t>(byte);
  }
  bool is_floating() const noexcept { return type_ == ValueType::float32 || type_ == ValueType::float64; }
  void set_integer_limits(const DbcSignal& signal);
  void set_named_numbers(const DbcSignal& signal);
  std::uint64_t integer_raw(double rounded) const noexcept;

  ValueType type_;
  std::uint16_t length_bits_;
  double factor_;
  double offset_;
  std::uint64_t mask_;

  // The byte of the least significant bit, the bit's position in it, and the direction of more significant
  // bytes.
  int low_byte_;
  int step_;
  unsigned shift_;
  int byte_count_;
  std::size_t needed_bytes_;

  // Limits: of the raw value for integers, of the physical value for floating point.
  double lowest_;
  double highest_;
  std::uint64_t lowest_raw_ = 0;
  std::uint64_t highest_raw_ = 0;
  std::vector<double> named_numbers_;  ///< raw numbers outside the limits that may still be sent; ascending
};

}  // namespace hil::io::can
