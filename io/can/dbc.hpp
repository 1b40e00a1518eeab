#pragma once
// Vector DBC files: the messages of a bus and the layout of their signals.
//
// Read: VERSION, NS_, BS_, BU_, BO_, SG_ (Intel and Motorola, signed, factor, offset, range, unit,
// multiplexing), SG_MUL_VAL_ (extended multiplexing), VAL_, VAL_TABLE_, SIG_VALTYPE_ (float, double), CM_,
// and the attributes (BA_DEF_, BA_DEF_DEF_, BA_) GenMsgCycleTime, GenSigStartValue, VFrameFormat, CANFD_BRS,
// SystemSignalLongSymbol, SystemMessageLongSymbol and SystemNodeLongSymbol. All other statements are skipped.
// White space, line ends and `//` comments between words have no meaning. A string that is not UTF-8 is read
// as cp1252; in a string `\"` stands for a quote and `\\` for a backslash.
//
// The parser reports a statement that it does not understand with its place, and continues at the next line
// that begins with a keyword. A message that no frame can carry is kept and marked as unusable.
//
// Threads: values; parse_dbc is a pure function.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hil::io::can {

enum class ByteOrder : std::uint8_t { intel, motorola };
enum class ValueType : std::uint8_t { unsigned_integer, signed_integer, float32, float64 };

/// The multiplexer values for which a multiplexed signal is present, both ends included.
struct MultiplexRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
};

struct DbcSignal {
  std::string name;        ///< SystemSignalLongSymbol where the file gives it
  std::string short_name;  ///< the name in its SG_ statement
  /// As written: the least significant bit for Intel; the most significant bit, in the sawtooth count, for
  /// Motorola.
  std::uint16_t start_bit = 0;
  std::uint16_t length_bits = 0;  ///< 1..64
  ByteOrder order = ByteOrder::intel;
  ValueType type = ValueType::unsigned_integer;
  double factor = 1.0;  ///< physical = raw * factor + offset; not zero
  double offset = 0.0;
  double minimum = 0.0;  ///< physical; both zero: no range given
  double maximum = 0.0;
  std::string unit;
  bool is_multiplexer = false;  ///< its raw value selects which multiplexed signals are present
  int multiplexer = -1;  ///< index in the message of the signal that selects this one; -1: always present
  std::vector<MultiplexRange> multiplex_ranges;  ///< ascending, disjoint
  bool fits = true;  ///< false: a bit lies beyond the message's length; its message is unusable
  std::map<std::int64_t, std::string> value_names;  ///< by raw value
  std::optional<double> start_raw;                  ///< GenSigStartValue, or its default
  bool start_is_default = false;                    ///< start_raw is the default of all signals

  bool has_range() const noexcept { return minimum < maximum; }
  /// True for an integer of more than 53 bits (without its sign): a double can not hold all of its values.
  bool is_wide_integer() const noexcept {
    return (type == ValueType::unsigned_integer && length_bits > 53) ||
           (type == ValueType::signed_integer && length_bits > 54);
  }
};

struct DbcMessage {
  std::string name;        ///< SystemMessageLongSymbol where the file gives it
  std::string short_name;  ///< the name in its BO_ statement
  std::uint32_t id = 0;    ///< 11 or 29 bits
  bool is_extended = false;
  std::uint16_t length_bytes = 0;  ///< of a usable message 0..64; above 8 only CAN FD
  bool is_fd = false;              ///< sent as an FD frame: VFrameFormat says so, or it has more than 8 bytes
  /// True if VFrameFormat or the length determines FD or classic format. Received frames of the other format
  /// are then rejected.
  bool format_is_stated = false;
  bool bit_rate_switch = false;  ///< CANFD_BRS, of an FD message
  std::string sender;
  std::int64_t cycle_time_ms = 0;  ///< GenMsgCycleTime, or its default; 0: not given
  std::vector<DbcSignal> signals;  ///< in the order of the file
  /// Why no frame can carry this message, one clause per reason; empty: it is usable.
  std::vector<std::string> unusable;

  /// By name, then by short name; null when there is none.
  const DbcSignal* find_signal(std::string_view signal_name) const noexcept;
};

struct Dbc {
  std::vector<DbcMessage> messages;  ///< in the order of the file, unusable ones included
  std::vector<std::string> nodes;
  std::map<std::string, std::map<std::int64_t, std::string>> value_tables;

  /// By name, then by short name; null when there is none.
  const DbcMessage* find_message(std::string_view message_name) const noexcept;
};

struct DbcProblem {
  enum class Severity : std::uint8_t {
    /// A message that can not be used, or not be sent: a scenario that uses it is rejected with this reason
    unusable,
    warning,  ///< a statement without effect: it names an unknown message or signal
    error,    ///< a statement that was not understood and is skipped; the rest of the file is usable
    fatal,    ///< the file is not usable
  };
  Severity severity = Severity::error;
  std::size_t line = 0;    ///< from 1
  std::size_t column = 0;  ///< from 1, in bytes
  std::string text;
};

struct DbcResult {
  static constexpr std::size_t kept_problems = 200;

  Dbc database;                      ///< what was understood
  std::vector<DbcProblem> problems;  ///< the first 200, in the order they were found
  std::size_t error_count = 0;       ///< the total number, including fatal ones
  std::size_t fatal_count = 0;
  std::size_t warning_count = 0;  ///< including `unusable` ones

  bool ok() const noexcept { return error_count == 0; }
  bool is_usable() const noexcept { return fatal_count == 0; }
};

/// A text that is not blank and has no message gives a fatal problem.
DbcResult parse_dbc(std::string_view text);

/// The largest file that load_dbc reads.
inline constexpr std::size_t max_dbc_bytes = std::size_t{64} << 20U;

/// A file that can not be read gives one fatal problem at line 0 with the system's error text.
DbcResult load_dbc(const std::filesystem::path& file);

/// "file:line:column: error: text", one problem per line, and the number of further ones.
std::string describe_problems(const DbcResult& result, std::string_view file_name);

}  // namespace hil::io::can
