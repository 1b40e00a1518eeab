#pragma once
// The parser behind parse_dbc: one member function per kind of statement. An object parses one text.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "io/can/dbc.hpp"
#include "io/can/dbc_scanner.hpp"

namespace hil::io::can {

class DbcParser {
 public:
  explicit DbcParser(std::string_view text) : text_(text), scanner_(text), lines_(text) {}

  DbcResult parse();

 private:
  using Severity = DbcProblem::Severity;

  /// What a signal statement contains beyond the signal itself.
  struct SignalNote {
    std::size_t position = 0;  ///< of its name, for problems found when its message is complete
    bool multiplexed = false;
    bool has_extended_ranges = false;
  };
  /// The value of an attribute as written: a number or a text.
  struct AttributeValue {
    std::optional<double> number;
    std::string text;
  };
  struct MessageNote {
    std::size_t position = 0;  ///< of its name
    std::vector<SignalNote> signals;
    std::unordered_map<std::string, std::size_t> signal_by_name;
    std::optional<AttributeValue> frame_format;
    std::optional<AttributeValue> bit_rate_switch;
    bool has_cycle_time = false;
    std::string long_name;
    std::vector<std::pair<std::size_t, std::string>> long_signal_names;
  };
  /// The contents of BA_DEF_ and BA_DEF_DEF_ for one attribute.
  struct AttributeDefinition {
    std::vector<std::string> words;  ///< of an ENUM
    std::optional<AttributeValue> initial;
  };
  enum class FrameFormat : std::uint8_t { unstated, classic, fd, j1939 };

  void parse_statement(std::string_view keyword);
  void parse_new_symbols();
  void parse_bit_timing();
  void parse_nodes();
  void parse_message();
  void add_message(DbcMessage message, std::uint64_t file_id, std::uint64_t length);
  void parse_signal();
  bool parse_multiplex_mark(DbcSignal& signal, SignalNote& note);
  bool parse_layout(DbcSignal& signal, std::string& defect);
  bool parse_scaling(DbcSignal& signal, std::string& defect);
  void add_signal(DbcSignal signal, const SignalNote& note, const std::string& defect);
  void skip_receivers();
  void parse_value_table();
  void parse_values();
  bool parse_value_list(std::map<std::int64_t, std::string>& values);
  void parse_value_type();
  void parse_extended_multiplexing();
  void parse_comment();
  void parse_attribute_definition();
  void parse_attribute_default();
  void parse_attribute();
  std::optional<AttributeValue> parse_attribute_value();
  void take_message_attribute(std::string_view name, std::uint32_t file_id, const AttributeValue& value);
  void take_signal_attribute(std::string_view name, std::uint32_t file_id, std::string_view signal,
                             const AttributeValue& value);
  std::string_view word();
  std::string_view parse_object();
  void skip_statement();
  void expect_semicolon();

  void complete_messages();
  void apply_attributes(DbcMessage& message, const MessageNote& note);
  FrameFormat format_of(const AttributeValue& value);
  bool switches_bit_rate(const AttributeValue& value);
  void apply_long_names();
  void link_multiplexers(DbcMessage& message, const MessageNote& note);
  void check_multiplexer_chains(DbcMessage& message, const MessageNote& note);
  void find_overlaps(DbcMessage& message, const MessageNote& note);

  MessageNote& note_of(const DbcMessage& message) {
    return notes_[static_cast<std::size_t>(&message - result_.database.messages.data())];
  }
  DbcMessage* message_of_id(std::uint32_t file_id);
  void report_unknown_message(std::uint32_t file_id, std::size_t position);
  DbcSignal* signal_of(std::uint32_t file_id, std::string_view name, std::size_t position);
  std::optional<double> number_of(const AttributeValue& value) const;
  std::optional<std::int64_t> cycle_time_of(const AttributeValue& value) const;

  bool fail(std::string_view expected);
  bool fail_unfinished();
  void make_unusable(DbcMessage& message, std::size_t position, const std::string& reason);
  void report(Severity severity, std::size_t position, std::string text);
  void locate_problems();

  std::string_view text_;
  DbcScanner scanner_;
  LineCounter lines_;
  DbcResult result_;
  std::vector<std::size_t> problem_positions_;  ///< one per problem of the result
  std::vector<MessageNote> notes_;              ///< one per message of the result
  std::unordered_map<std::uint32_t, std::size_t> message_by_id_;
  std::unordered_map<std::string, std::size_t> message_by_name_;
  std::map<std::string, AttributeDefinition, std::less<>> attributes_;
  std::map<std::string, std::string, std::less<>> long_node_names_;
  std::size_t statement_position_ = 0;    ///< of the keyword of the statement that is being parsed
  bool statement_has_semicolon_ = false;  ///< statements of its kind end with one
  /// Its BO_ or SG_ begins a line and may therefore be the next statement
  bool object_may_be_statement_ = false;
  bool signals_wanted_ = false;                  ///< SG_ statements belong to the last message of the result
  bool signals_skipped_ = false;                 ///< SG_ statements belong to a message that is discarded
  std::optional<std::size_t> unknown_position_;  ///< of a line in the last message that is not a statement
  std::uint64_t overlap_steps_ = 0;              ///< work of find_overlaps so far
};

}  // namespace hil::io::can
