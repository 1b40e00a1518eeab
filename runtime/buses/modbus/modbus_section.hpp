#pragma once
// A Modbus unit in a scenario. Signals that it is written from keep their place for error texts.
//
// Threads: immutable once loaded; any thread may read.

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "io/modbus/register_map.hpp"
#include "runtime/config/bus_section.hpp"

namespace hil::buses::modbus {

using config::Place;
using config::Word;

struct RegisterWrite {
  Word entry;
  std::variant<Word, double> source;  ///< a signal of the run, or a constant
  Place source_place;
};

class ModbusSection final : public config::BusSection {
 public:
  io::modbus::Role role = io::modbus::Role::client;
  std::string host;
  std::optional<std::uint16_t> port;  ///< empty: a free one is chosen
  Place device_place;
  std::string registers_file;
  io::modbus::RegisterMap registers;  ///< passes io::modbus::mistakes_in for the role
  std::int64_t timeout_ns = 0;
  std::optional<std::int64_t>
      max_age_ns;  ///< empty: the device's own, 1 s for a client, any age for a server
  std::int64_t start_timeout_ns = 0;
  std::uint8_t unit_id = 1;
  std::uint16_t max_gap = 0;    ///< of a client
  std::size_t max_clients = 0;  ///< of a server
  bool is_optional = false;     ///< the run may pass although values of its registers do not come
  std::optional<Word> run_time_entry;
  std::optional<Word> heartbeat_entry;
  std::vector<RegisterWrite> write;
  std::vector<Word> read;

  void read_entry(const config::Value& entry, config::ReaderContext& reading) override;
  /// Refuses a free port (auto) of a client when no process's command names the unit, so that no server knows
  /// it.
  void check_commands(bool is_in_a_command, config::Diagnostics& diagnostics) const override;
  bool gives_run_time() const override { return run_time_entry.has_value(); }
};

/// What the list `modbus` of a scenario may contain.
config::BusSectionType modbus_section_type();

}  // namespace hil::buses::modbus
