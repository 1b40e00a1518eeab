#pragma once
// A DBC database while its text is being parsed: the messages so far, with data that later statements and the
// final checks need.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "io/can/dbc.hpp"
#include "io/can/dbc_problems.hpp"

namespace hil::io::can {

/// The value of an attribute as written: a number or a text.
struct DbcAttributeValue {
  std::optional<double> number;
  std::string text;
};

/// What a signal statement contains beyond the signal itself.
struct DbcSignalNote {
  std::size_t position = 0;  ///< of its name, for problems found when its message is complete
  bool multiplexed = false;
  bool has_extended_ranges = false;
};

/// What statements say about a message beyond the message itself.
struct DbcMessageNote {
  std::size_t position = 0;  ///< of its name
  std::vector<DbcSignalNote> signals;
  std::unordered_map<std::string, std::size_t> signal_by_name;
  std::optional<DbcAttributeValue> frame_format;
  std::optional<DbcAttributeValue> bit_rate_switch;
  bool has_cycle_time = false;
  std::string long_name;
  std::vector<std::pair<std::size_t, std::string>> long_signal_names;
};

/// VECTOR__INDEPENDENT_SIG_MSG, which holds signals of no frame.
inline constexpr std::uint32_t pseudo_message_id = 0xC0000000U;

struct DbcDraft {
  Dbc database;
  std::vector<DbcMessageNote> notes;  ///< one per message of the database
  std::unordered_map<std::uint32_t, std::size_t>
      message_by_id;  ///< by identifier with bit 31, as in the file
  std::unordered_map<std::string, std::size_t> message_by_name;

  DbcMessageNote& note_of(const DbcMessage& message) {
    return notes[static_cast<std::size_t>(&message - database.messages.data())];
  }
  /// Null when there is none.
  DbcMessage* message_of_id(std::uint32_t file_id);
  /// Null, after a report at `position`, when there is none. The pseudo message is not reported.
  DbcMessage* find_message(std::uint32_t file_id, std::size_t position, DbcProblems& problems);
  DbcSignal* find_signal(std::uint32_t file_id, std::string_view name, std::size_t position,
                         DbcProblems& problems);
};

}  // namespace hil::io::can
