#pragma once
// The parser behind parse_dbc: one member function per kind of statement. An object parses one text.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "io/can/dbc.hpp"
#include "io/can/dbc_attributes.hpp"
#include "io/can/dbc_draft.hpp"
#include "io/can/dbc_statement_reader.hpp"

namespace hil::io::can {

class DbcParser : private DbcStatementReader {
 public:
  explicit DbcParser(std::string_view text) : DbcStatementReader(text), lines_(text) {}

  DbcResult parse();

 private:
  void parse_statement(std::string_view keyword);
  void parse_new_symbols();
  void parse_bit_timing();
  void parse_nodes();
  void parse_message();
  void add_message(DbcMessage message, std::uint64_t file_id, std::uint64_t length);
  void parse_signal();
  bool parse_multiplex_mark(DbcSignal& signal, DbcSignalNote& note);
  bool parse_layout(DbcSignal& signal, std::string& defect);
  bool parse_scaling(DbcSignal& signal, std::string& defect);
  void add_signal(DbcSignal signal, const DbcSignalNote& note, const std::string& defect);
  void parse_value_table();
  void parse_values();
  void parse_value_type();
  void parse_extended_multiplexing();
  void parse_comment();
  void parse_attribute_definition();
  void parse_attribute_default();
  void parse_attribute();
  void complete_messages();

  LineCounter lines_;
  DbcDraft draft_;
  DbcAttributes attributes_;
  bool signals_wanted_ = false;                  ///< SG_ statements belong to the last message of the draft
  bool signals_skipped_ = false;                 ///< SG_ statements belong to a message that is discarded
  std::optional<std::size_t> unknown_position_;  ///< of a line in the last message that is not a statement
};

}  // namespace hil::io::can
