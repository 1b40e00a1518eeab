#include "io/can/dbc_statement_reader.hpp"

#include <cmath>
#include <string>

#include "io/can/dbc_keywords.hpp"
#include "io/can/dbc_text.hpp"

namespace hil::io::can {

void DbcStatementReader::skip_statement() {
  while (!scanner_.accept(';')) {
    if (scanner_.at_end() || scanner_.at_statement_line()) return static_cast<void>(fail_unfinished());
    if (scanner_.peek() == '"') {
      if (!scanner_.quoted()) return static_cast<void>(fail_unfinished());
    } else if (scanner_.identifier().empty()) {
      scanner_.skip_byte();
    }
  }
}

void DbcStatementReader::expect_semicolon() {
  if (!scanner_.accept(';')) fail_unfinished();
}

std::string_view DbcStatementReader::word() {
  return scanner_.at_statement_line() ? std::string_view() : scanner_.identifier();
}

std::string_view DbcStatementReader::parse_object() {
  if (!is_dbc_object(scanner_.peek_identifier())) return {};
  object_may_be_statement_ = scanner_.at_statement_line();
  return scanner_.identifier();
}

bool DbcStatementReader::fail(std::string_view expected) {
  if (statement_has_semicolon_) {
    const std::size_t failed_at = scanner_.position();
    const bool is_string_open = scanner_.peek() == '"' && !scanner_.quoted();
    scanner_.move_to(failed_at);
    if (scanner_.at_end() || scanner_.at_statement_line() || is_string_open || object_may_be_statement_)
      return fail_unfinished();
  }
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  std::string found = scanner_.at_end() ? "the end of the file" : "'";
  for (std::size_t at = position; at < text_.size() && at < position + 20; ++at) {
    const char c = text_[at];
    if (c == '\n' || c == '\r') break;
    found.push_back(c >= ' ' && c <= '~' ? c : '?');
  }
  if (!scanner_.at_end()) found.push_back('\'');
  problems_.report(DbcProblem::Severity::error, position,
                   "expected " + std::string(expected) + ", found " + found + "; the statement is left out");
  scanner_.skip_to_statement_line(statement_position_);
  return false;
}

bool DbcStatementReader::fail_unfinished() {
  problems_.report(DbcProblem::Severity::error, statement_position_, "this statement has no ';' at its end");
  if (!scanner_.at_statement_line() || object_may_be_statement_)
    scanner_.skip_to_statement_line(statement_position_);
  return false;
}

bool DbcStatementReader::parse_value_list(std::map<std::int64_t, std::string>& values) {
  while (!scanner_.accept(';')) {
    if (scanner_.at_statement_line()) {  // the names read so far are complete
      fail_unfinished();
      return true;
    }
    const std::size_t position = scanner_.position();
    // Unsigned first: a raw value may use all 64 bits.
    const auto whole = scanner_.number<std::uint64_t>();
    std::int64_t raw = whole ? static_cast<std::int64_t>(*whole) : 0;
    if (!whole || scanner_.peek() != '"') {
      scanner_.move_to(position);
      const auto value = scanner_.number<double>();
      if (!value || !(std::abs(*value) < 9.2e18)) return fail("a value, or ';' at the end of the list");
      raw = static_cast<std::int64_t>(*value);
    }
    const auto text = scanner_.quoted();
    if (!text) return fail("the value's name in double quotes");
    values.insert_or_assign(raw, dbc_text(*text));
  }
  return true;
}

std::optional<DbcAttributeValue> DbcStatementReader::parse_attribute_value() {
  DbcAttributeValue value;
  if (const auto text = scanner_.quoted()) {
    value.text = dbc_text(*text);
    return value;
  }
  value.number = scanner_.number<double>();
  if (!value.number) return std::nullopt;
  return value;
}

void DbcStatementReader::skip_receivers() {
  while (true) {
    const std::string_view receiver = scanner_.peek_identifier();
    if (receiver.empty() || is_dbc_keyword(receiver)) break;
    scanner_.identifier();
    if (!scanner_.accept(',') && scanner_.is_first_in_line()) break;
  }
  if (scanner_.at_end() || scanner_.is_first_in_line() || is_dbc_keyword(scanner_.peek_identifier())) return;
  problems_.report(DbcProblem::Severity::warning, scanner_.position(),
                   "what follows the signal's unit is no list of receivers");
  scanner_.skip_to_statement_line(scanner_.position());
}

}  // namespace hil::io::can
