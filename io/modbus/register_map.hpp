#pragma once
// The values of a Modbus unit and their registers. A plain description: register_codec.hpp converts values to
// registers, request_plan.hpp derives requests from a map, and runtime/config reads a map from a file.
//
// Threads: free functions on values, callable from any thread.

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace hil::io::modbus {

enum class Table : std::uint8_t { coil, discrete_input, holding, input };

enum class ValueType : std::uint8_t { boolean, u16, i16, u32, i32, u64, i64, f32, f64 };

/// The order of a value's bytes in its registers; A is the most significant byte of 32 bits. 64-bit values
/// extend the pattern (CDAB: least significant register first; DCBA: least significant byte first). For 16
/// bits, BADC and DCBA swap the two bytes, ABCD and CDAB do not. Has no effect on booleans.
enum class ByteOrder : std::uint8_t { abcd, cdab, badc, dcba };

/// One value: value = raw * scale + offset, where raw is the number in the registers.
struct RegisterEntry {
  std::string name;
  Table table = Table::holding;
  /// Protocol address, from 0; the holding register written "40001" has address 0
  std::uint16_t address = 0;
  ValueType type = ValueType::u16;
  ByteOrder order = ByteOrder::abcd;
  double scale = 1.0;
  double offset = 0.0;
  std::string unit;  ///< of the scaled value; empty: dimensionless
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  double safe_value = 0.0;
  bool writable = false;     ///< from the view of hil. true: hil writes it; false: hil reads it
  bool is_optional = false;  ///< of one that hil reads: a value need not come
};

struct RegisterMap {
  std::vector<RegisterEntry> entries;

  /// The entry with this name, or null. Valid until `entries` changes.
  const RegisterEntry* find(std::string_view name) const noexcept;
  /// The number of entries that hil reads.
  std::size_t read_count() const noexcept;
};

/// The role of hil on the connection.
enum class Role : std::uint8_t {
  client,  ///< hil sends requests: it can only write coils and holding registers
  server,  ///< hil answers: only coils and holding registers can come from the clients
};

/// Every mistake of a map, one sentence each, in the order of the entries; empty if there is none. Checks
/// names (present, unique), types (bits in bit tables), addresses (the value ends at or before 65535),
/// overlaps, tables that the role can not write, scale (finite, not 0), offset (finite), minimum <= maximum,
/// and the safe value (inside both the range and the type).
std::vector<std::string> mistakes_in(const RegisterMap& map, Role role);

/// The number of registers of a value of this type (1 for a bit).
std::uint16_t width_of(ValueType type) noexcept;
bool is_bit_table(Table table) noexcept;
/// The name in register map files: "holding", "discrete_input", ...
std::string_view to_text(Table table) noexcept;
std::string_view to_text(ValueType type) noexcept;
std::string_view to_text(ByteOrder order) noexcept;
/// "holding 10" or "holding 10..11".
std::string place_of(Table table, std::uint16_t address, std::uint32_t count);

/// The addresses that a request reads or writes.
struct RequestRange {
  bool writes = false;
  Table table = Table::holding;
  std::uint16_t address = 0;
  std::uint16_t count = 0;
};

/// Whether the entry has an address in the range.
bool touches(const RegisterEntry& entry, const RequestRange& range) noexcept;

/// "reading level (holding 10)", "writing level, valve and 3 more (holding 10..17)": the entries of `map`
/// that it touches, in their order. "reading holding 10": it touches none.
std::string text_of(const RequestRange& range, const RegisterMap& map);

}  // namespace hil::io::modbus
