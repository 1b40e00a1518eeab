#pragma once
// Adjacent entries of a register map gathered into as few requests as the protocol permits.
//
// Threads: free functions, callable from any thread; they allocate.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/modbus/register_map.hpp"

namespace hil::io::modbus {

/// What one request may carry, by the Modbus application protocol 1.1b3.
inline constexpr std::uint16_t max_registers_read = 125;
inline constexpr std::uint16_t max_registers_written = 123;
inline constexpr std::uint16_t max_bits_read = 2000;
inline constexpr std::uint16_t max_bits_written = 1968;

/// `count` addresses of a table in one request, and the entries that lie in them (indices into the map), by
/// address.
struct PlannedRequest {
  Table table = Table::holding;
  std::uint16_t address = 0;
  std::uint16_t count = 0;
  std::vector<std::size_t> entries;
};

enum class Access : std::uint8_t { read, write };

/// The fewest requests that carry every chosen entry whole. Between two entries of one read at most `max_gap`
/// addresses that belong to neither are read along and thrown away; a write never touches an address that is
/// not its own, whatever `max_gap` says. Order: by table, then by address. Misuse (asserts): an index outside
/// the map, or a map in which mistakes_in finds something (overlaps are not looked for here).
std::vector<PlannedRequest> plan_requests(const RegisterMap& map, std::span<const std::size_t> chosen,
                                          Access access, std::uint16_t max_gap);

}  // namespace hil::io::modbus
