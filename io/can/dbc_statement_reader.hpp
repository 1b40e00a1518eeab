#pragma once
// Reads what the statements of a DBC text have in common, and reports statements that are not understood.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "io/can/dbc_draft.hpp"
#include "io/can/dbc_problems.hpp"
#include "io/can/dbc_scanner.hpp"

namespace hil::io::can {

class DbcStatementReader {
 protected:
  explicit DbcStatementReader(std::string_view text) : text_(text), scanner_(text) {}

  /// The identifier here; empty when there is none, or when it begins the next statement.
  std::string_view word();
  /// The kind of object that a comment or an attribute belongs to: BU_, BO_, SG_ or EV_. Empty: none of them.
  std::string_view parse_object();
  /// Skips the statement up to its ';', or up to a line that begins with a keyword.
  void skip_statement();
  void expect_semicolon();
  /// Names, separated by commas, or by blanks in one line. Reports what follows them in the line.
  void skip_receivers();
  /// `value "name" ... ;`
  bool parse_value_list(std::map<std::int64_t, std::string>& values);
  /// A number or a text; empty: neither is here.
  std::optional<DbcAttributeValue> parse_attribute_value();
  /// Reports that the text here is not the expected one, and moves to the next statement. Returns false.
  bool fail(std::string_view expected);
  /// Reports that the statement ends without its ';', and moves to the next statement. Returns false.
  bool fail_unfinished();

  std::string_view text_;
  DbcScanner scanner_;
  DbcProblems problems_;
  std::size_t statement_position_ = 0;    ///< of the keyword of the statement that is being parsed
  bool statement_has_semicolon_ = false;  ///< statements of its kind end with one
  /// Its BO_ or SG_ begins a line and may therefore be the next statement.
  bool object_may_be_statement_ = false;
};

}  // namespace hil::io::can
