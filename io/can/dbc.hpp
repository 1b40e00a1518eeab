#pragma once
// Vector DBC files: which messages a bus carries and how signals lie in them.
//
// Understood: VERSION, NS_, BS_, BU_, BO_, SG_ (Intel and Motorola, signed, factor, offset, range, unit,
// multiplexing), SG_MUL_VAL_ (extended multiplexing), VAL_, VAL_TABLE_, SIG_VALTYPE_ (float, double), BA_ and
// BA_DEF_DEF_ of GenMsgCycleTime. All other statements are passed over. Text that is not UTF-8 is taken for
// Latin-1.
//
// Threads: values; parse_dbc is a pure function.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace hil::io::can {

enum class ByteOrder : std::uint8_t { intel, motorola };
enum class ValueType : std::uint8_t { unsigned_integer, signed_integer, float32, float64 };

/// The switch values for which a multiplexed signal is present, both ends included.
struct MultiplexRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
};

struct DbcSignal {
  std::string name;
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
  std::vector<MultiplexRange> multiplex_ranges;
  bool fits = true;       ///< false: a bit lies beyond the message's length; such a signal has no value
  bool overlaps = false;  ///< shares a bit with an earlier signal that can be present together with it
  std::map<std::int64_t, std::string> value_names;

  bool has_range() const noexcept { return minimum < maximum; }
};

struct DbcMessage {
  std::string name;
  std::uint32_t id = 0;  ///< 11 or 29 bits
  bool id_fits = true;   ///< false: the file's identifier has more bits; no frame can carry it
  bool is_extended = false;
  std::uint16_t length_bytes = 0;  ///< 0..64; above 8 only CAN FD
  std::string sender;
  std::int64_t cycle_time_ms = 0;  ///< GenMsgCycleTime; 0: not given
  std::vector<DbcSignal> signals;  ///< in the order of the file

  /// Null when there is none of that name.
  const DbcSignal* find_signal(std::string_view signal_name) const noexcept;
};

struct Dbc {
  std::vector<DbcMessage> messages;  ///< in the order of the file
  std::vector<std::string> nodes;
  std::map<std::string, std::map<std::int64_t, std::string>> value_tables;

  /// Null when there is none of that name.
  const DbcMessage* find_message(std::string_view message_name) const noexcept;
};

struct DbcProblem {
  enum class Severity : std::uint8_t {
    warning,  ///< the file can be used: overlapping signals, signals beyond their message, names of unknown
              ///< signals
    error,    ///< a statement was not understood; the database is incomplete
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
  std::size_t error_count = 0;       ///< all of them
  std::size_t warning_count = 0;

  bool ok() const noexcept { return error_count == 0; }
};

DbcResult parse_dbc(std::string_view text);

/// A file that can not be read gives one error at line 0 with the system's answer.
DbcResult load_dbc(const std::filesystem::path& file);

/// "file:line:column: error: text", one problem a line, and how many more there are.
std::string describe_problems(const DbcResult& result, std::string_view file_name);

}  // namespace hil::io::can
