#pragma once
// A CAN bus in a scenario. Names that are looked up when the bus is wired (a signal, a message of the DBC
// file) keep their place for error texts.
//
// Threads: immutable once loaded; any thread may read.

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "runtime/config/bus_section.hpp"

namespace hil::buses::can {

using config::Place;
using config::Word;

/// The source of a signal of a message.
struct SignalSource {
  Word dbc_signal;
  std::variant<Word, double> source;  ///< a signal of the run or a value name of the DBC file, or a constant
  Place source_place;
};

struct SafeValue {
  Word dbc_signal;
  std::variant<Word, double> value;  ///< a value name of the DBC file, or a number
  Place value_place;
};

struct SentMessage {
  Word message;
  /// A multiple of the bus's period; 0: the cycle time of the DBC file, or the bus's period.
  std::int64_t period_ns = 0;
  std::int64_t offset_ns = 0;  ///< a multiple of the bus's period, less than the message's period
  Place offset_place;
  std::optional<Word> counter;
  std::optional<Word> checksum;
  std::vector<SignalSource> signals;
  std::vector<SafeValue> safe;
};

struct ReceivedMessage {
  Word message;
  std::optional<std::int64_t> timeout_ns;  ///< 0: never; empty: three cycle times of the DBC file
  std::optional<Word> counter;
  std::optional<Word> checksum;
  bool is_optional = false;        ///< the run may pass although it does not come
  std::uint64_t max_rejected = 0;  ///< frames that may be rejected in a run that passes
  std::vector<SafeValue> safe;
};

/// The unit of a signal in place of that of the DBC file.
struct SignalUnit {
  Word message;
  Word dbc_signal;
  std::string unit;  ///< a unit of units::parse_unit
};

/// Faults that a virtual bus injects.
struct BusFaults {
  double drop = 0.0;     ///< probability per frame
  double corrupt = 0.0;  ///< probability per frame
  std::int64_t delay_ns = 0;
};

/// A log whose frames the bus sends.
struct PlayedLog {
  Word file{};                       ///< the absolute path
  std::optional<Word> interface {};  ///< whose frames are played; empty: the log has one
  std::int64_t begin_ns = 0;         ///< run time of the first line
  Place begin_place{};
  std::uint64_t repeat = 1;                ///< passes; 0: to the end of the run
  std::optional<std::int64_t> every_ns{};  ///< from one pass to the next; empty: the length of the log
  Place every_place{};
  std::int64_t run_ns = 0;  ///< duration of the run; 0: it is not known
  std::int64_t send_interval_ns =
      0;  ///< between the instants at which the bus sends; 0: it sends at any time
};

class CanSection final : public config::BusSection {
 public:
  std::string interface;  ///< of SocketCAN; empty: a virtual bus
  Place device_place;
  std::string database;  ///< absolute path of the DBC file
  double bits_per_second = 0.0;
  std::vector<SignalUnit> units;
  std::vector<SentMessage> send;
  std::vector<ReceivedMessage> receive;
  BusFaults faults;
  std::optional<PlayedLog> play;

  bool is_virtual() const noexcept { return interface.empty(); }
  void read_entry(const config::Value& entry, config::ReaderContext& reading) override;
};

/// What the list `can` of a scenario may contain.
config::BusSectionType can_section_type();

}  // namespace hil::buses::can
