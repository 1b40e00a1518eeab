#pragma once
// Counts values outside the range of their register, and adds an event for the first one of each episode. An
// episode of a register lasts from such a value to the next one in range.

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "io/modbus/event_list.hpp"
#include "io/modbus/register_codec.hpp"
#include "io/modbus/register_map.hpp"

namespace hil::io::modbus {

/// Counted since construction. Outputs are the registers that hil writes, inputs those that it reads.
struct ValueCounters {
  std::uint64_t saturated_outputs = 0;     ///< outside range or type: the nearest limit was written
  std::uint64_t out_of_range_inputs = 0;   ///< outside the range: read as it is
  std::uint64_t not_a_number_outputs = 0;  ///< NaN: the register keeps its value
  std::uint64_t not_a_number_inputs = 0;   ///< NaN or infinite: the input keeps its last value
};

class ValueWatch {
 public:
  /// `map` and `events` outlive it. `device` begins each event ("Modbus unit plc").
  ValueWatch(const RegisterMap& map, std::string device, EventList& events);

  /// One thread at a time. `value`: the value to write, or that of the registers.
  void note(std::size_t entry, Conversion conversion, double value, RunTimeNs time_ns);
  /// Notes that a client's write was refused because `value` is outside the register's range (server only).
  void note_refused_write(std::size_t entry, double value, RunTimeNs time_ns);

  /// Any thread.
  ValueCounters counters() const noexcept;

 private:
  enum class Episode : std::uint8_t { none, out_of_range, not_a_number, refused_write };

  void begin_episode(std::size_t entry, Episode episode, RunTimeNs time_ns, const std::string& what);

  const RegisterMap& map_;
  const std::string device_;
  EventList& events_;
  std::vector<Episode> episodes_;  ///< by entry of the map
  std::atomic<std::uint64_t> saturated_outputs_{0}, out_of_range_inputs_{0}, not_a_number_outputs_{0},
      not_a_number_inputs_{0};
};

/// "0 to 65535": the range of values that the register takes.
std::string range_text(const RegisterEntry& entry);

}  // namespace hil::io::modbus
