#pragma once
// Combines adjacent entries of a register map into as few requests as the protocol allows.
//
// Threads: free functions, callable from any thread; they allocate.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/modbus/register_map.hpp"

namespace hil::io::modbus {

/// Limits of one request by the Modbus application protocol 1.1b3.
inline constexpr std::uint16_t max_registers_read = 125;
inline constexpr std::uint16_t max_registers_written = 123;
inline constexpr std::uint16_t max_bits_read = 2000;
inline constexpr std::uint16_t max_bits_written = 1968;

/// One request: `count` addresses of a table, and the entries in them (indices into the map) by address.
struct PlannedRequest {
  Table table = Table::holding;
  std::uint16_t address = 0;
  std::uint16_t count = 0;
  std::vector<std::size_t> entries;
};

enum class Access : std::uint8_t { read, write };

/// The fewest requests that contain every chosen entry completely. A read may include up to `max_gap`
/// unmapped addresses between two entries, whose values are discarded; a write contains chosen entries only.
/// Ordered by table, then by address. Misuse (asserts): an index outside the map; a map with mistakes_in()
/// other than overlaps.
std::vector<PlannedRequest> plan_requests(const RegisterMap& map, std::span<const std::size_t> chosen,
                                          Access access, std::uint16_t max_gap);

}  // namespace hil::io::modbus
