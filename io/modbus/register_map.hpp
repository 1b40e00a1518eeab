#pragma once
// Which values a Modbus unit holds and where. A plain description: register_codec.hpp turns values into
// registers, request_plan.hpp turns a map into requests. Reading a map from a file is the business of
// runtime/config.
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

/// How the bytes of a value lie in its registers; A is the most significant byte of 32 bits. For 64 bits the
/// same pattern goes on (CDAB: the least significant register first; DCBA: the least significant byte first).
/// For 16 bits only the order of bytes counts: BADC and DCBA swap the two, ABCD and CDAB do not. Nothing for
/// booleans.
enum class ByteOrder : std::uint8_t { abcd, cdab, badc, dcba };

/// One value. value = raw * scale + offset, raw being what the registers hold.
struct RegisterEntry {
  std::string name;
  Table table = Table::holding;
  std::uint16_t address = 0;  ///< as in the protocol: from 0; the holding register written "40001" is 0
  ValueType type = ValueType::u16;
  ByteOrder order = ByteOrder::abcd;
  double scale = 1.0;
  double offset = 0.0;
  std::string unit;  ///< of the value, after scaling; empty: dimensionless
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  double safe_value = 0.0;
  bool writable = false;  ///< seen from hil: hil writes it. false: hil reads it
};

struct RegisterMap {
  std::vector<RegisterEntry> entries;

  /// The entry of that name, or null. Valid until `entries` changes.
  const RegisterEntry* find(std::string_view name) const noexcept;
  /// The number of entries that hil reads.
  std::size_t read_count() const noexcept;
};

/// What hil is on the connection.
enum class Role : std::uint8_t {
  client,  ///< hil sends requests: it can only write coils and holding registers
  server,  ///< hil answers: only coils and holding registers can come from the clients
};

/// Everything that is wrong with a map, one sentence each, in the order of the entries; empty when nothing
/// is. Checked: names (present, unique), types (bits in bit tables), addresses (the value ends at or before
/// 65535), overlaps, tables that the role can not write, scale (finite, not 0), offset (finite), minimum <=
/// maximum, safe value (inside both the range and the type).
std::vector<std::string> mistakes_in(const RegisterMap& map, Role role);

/// Registers that a value of the type takes (1 for a bit).
std::uint16_t width_of(ValueType type) noexcept;
bool is_bit_table(Table table) noexcept;
/// "holding", "discrete_input", ...: as written in register map files.
std::string_view to_text(Table table) noexcept;
std::string_view to_text(ValueType type) noexcept;
std::string_view to_text(ByteOrder order) noexcept;
/// "holding 10" or "holding 10..11".
std::string place_of(Table table, std::uint16_t address, std::uint32_t count);

}  // namespace hil::io::modbus
