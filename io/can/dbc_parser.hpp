#pragma once
// The parser behind parse_dbc: one member function per kind of statement. Used once.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "io/can/dbc.hpp"
#include "io/can/dbc_scanner.hpp"

namespace hil::io::can {

class DbcParser {
 public:
  explicit DbcParser(std::string_view text) : text_(text), scanner_(text), lines_(text) {}

  DbcResult parse();

 private:
  /// What a signal line said beyond the signal itself.
  struct SignalNote {
    std::size_t position = 0;  ///< of its name, for problems found when its message is complete
    bool multiplexed = false;
  };
  struct MessageNote {
    std::vector<SignalNote> signals;
    bool has_extended_ranges = false;
  };

  void parse_statement(std::string_view keyword, std::size_t keyword_position);
  void parse_new_symbols();
  void parse_nodes();
  void parse_message();
  void parse_signal(std::size_t keyword_position);
  bool parse_multiplex_mark(DbcSignal& signal, SignalNote& note);
  bool parse_layout(DbcSignal& signal);
  bool parse_scaling(DbcSignal& signal);
  void parse_value_table();
  void parse_values();
  bool parse_value_list(std::map<std::int64_t, std::string>& values);
  void parse_value_type();
  void parse_extended_multiplexing();
  void parse_attribute();
  void parse_attribute_default();
  void pass_over(std::size_t keyword_position);

  void complete_messages();
  void link_multiplexers(DbcMessage& message, const MessageNote& note);
  void find_overlaps(DbcMessage& message, const MessageNote& note);

  DbcMessage* message_of_id(std::uint32_t file_id);
  DbcSignal* signal_of(std::uint32_t file_id, std::string_view name, std::size_t position);
  bool fail(std::string_view expected);
  void report(DbcProblem::Severity severity, std::size_t position, std::string text);

  std::string_view text_;
  DbcScanner scanner_;
  LineCounter lines_;
  DbcResult result_;
  std::vector<MessageNote> notes_;  ///< one per message of the result
  std::unordered_map<std::uint32_t, std::size_t> message_by_id_;
  std::unordered_map<std::string, std::size_t> message_by_name_;
  bool signals_wanted_ = false;       ///< SG_ lines belong to the last message of the result
  bool signals_passed_over_ = false;  ///< SG_ lines belong to a message that is not kept
  std::int64_t default_cycle_time_ms_ = 0;
  std::vector<std::uint32_t> has_cycle_time_;
};

}  // namespace hil::io::can
