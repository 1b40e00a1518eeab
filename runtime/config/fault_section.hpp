#pragma once
// The section `faults` of a scenario.
//
// Threads: immutable once loaded.

#include <cstdint>
#include <optional>
#include <vector>

#include <hil/schema.hpp>

#include "runtime/config/activation_section.hpp"
#include "runtime/config/expression.hpp"

namespace hil::config {

/// The longest delay of a signal, a frame or a reply: what is delayed is kept in memory.
inline constexpr double max_fault_delay_s = 60.0;

struct FaultSection {
  enum class Target : std::uint8_t {
    signal,   ///< what its readers read in place of it
    message,  ///< its frames on their way from or to the bus
    device,   ///< a bus or unit as the run sees it
    process,  ///< that the run starts
    task,
  };
  enum class Kind : std::uint8_t {
    // Of a signal or a message.
    stuck_at_last,
    // Of a signal.
    stuck,
    offset,
    gain,
    noise,
    drift,
    dropout,
    // Of a signal, a message or a device.
    delay,
    // Of a message.
    drop,
    repeat,
    wrong_counter,
    wrong_checksum,
    length,
    flip_bits,
    // Of a device.
    bus_off,
    silent,
    disconnected,
    exception,
    // Of a process.
    paused,
    killed,
    // Of a task.
    takes_longer,
  };
  Word name;
  Target target = Target::signal;
  Word subject{};  ///< the name of the target
  Kind kind = Kind::stuck_at_last;
  Place place{};                      ///< of the kind
  std::optional<Expression> value{};  ///< stuck, offset, gain, noise (its deviation), drift
  std::int64_t duration_ns = 0;       ///< delay, takes_longer
  double share = 0.0;                 ///< dropout: of the ticks; drop: of the frames
  std::uint32_t number = 0;           ///< repeat: further frames; length: bytes; exception: its code
  std::vector<std::uint32_t> bits{};  ///< flip_bits: 8 * byte + bit
  std::vector<Word> readers{};        ///< of a signal: modules, buses, inputs of them; empty: all
  ActivationSection activation{};
  std::string test_table{};  ///< name of the test table that defines it; empty: the scenario does

  /// In words, for the report: "stuck at its last value".
  std::string effect() const;
};

struct ReaderContext;

Schema faults_schema();
/// Adds the entries without mistakes.
void read_faults(const Value& root, Scenario& scenario, ReaderContext& reading);

}  // namespace hil::config
