#include "io/can/dbc_parser.hpp"

#include <linux/can.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "io/can/dbc_text.hpp"

namespace hil::io::can {

namespace {

constexpr std::uint32_t extended_flag = 0x80000000U;
constexpr std::uint32_t pseudo_message_id = 0xC0000000U;  // VECTOR__INDEPENDENT_SIG_MSG: signals of no frame
// Per message; more signals are a mistake, and would be slow to check
constexpr std::size_t max_signals = 2048;

/// Why no frame can have the identifier of a BO_ statement; empty: it is valid.
std::string identifier_defect(std::uint64_t file_id) {
  const std::string identifier = "identifier " + std::to_string(file_id);
  if (file_id > 0xFFFFFFFFU) return identifier + " needs more than 32 bits";
  const std::uint64_t id = file_id & ~std::uint64_t{extended_flag};
  const bool is_extended = id != file_id;
  if (is_extended && id > CAN_EFF_MASK)
    return identifier +
           " has bit 31 set, which marks a 29-bit identifier, and needs more than 29 bits besides";
  if (is_extended || id <= CAN_SFF_MASK) return {};
  return identifier + " needs more than 11 bits, and bit 31, which marks a 29-bit identifier, is not set";
}

}  // namespace

DbcResult DbcParser::parse() {
  if (text_.substr(0, 3) == "\xEF\xBB\xBF") scanner_.move_to(3);
  scanner_.skip_space();
  const std::size_t first_position = scanner_.position();
  const bool is_blank = scanner_.at_end();
  while (scanner_.peek() != '\0' || !scanner_.at_end()) {
    statement_position_ = scanner_.position();
    statement_has_semicolon_ = false;
    object_may_be_statement_ = false;
    const std::string_view keyword = scanner_.identifier();
    if (!is_dbc_keyword(keyword)) {
      scanner_.move_to(statement_position_);
      unknown_position_ = statement_position_;
      fail("a DBC keyword");
      continue;
    }
    parse_statement(keyword);
  }
  complete_messages();
  if (!is_blank && result_.database.messages.empty())
    report(Severity::fatal, first_position,
           "the file gives no message: it has no BO_ statement that is understood");
  locate_problems();
  return std::move(result_);
}

void DbcParser::parse_statement(std::string_view keyword) {
  if (keyword == "SG_") return parse_signal();
  unknown_position_.reset();
  signals_wanted_ = false;
  signals_skipped_ = false;
  if (keyword == "BO_") return parse_message();
  if (keyword == "VERSION") {
    if (!scanner_.quoted()) fail("the version in double quotes");
    return;
  }
  if (keyword == "NS_") return parse_new_symbols();
  if (keyword == "BS_") return parse_bit_timing();
  if (keyword == "BU_") return parse_nodes();
  statement_has_semicolon_ = true;
  if (keyword == "VAL_") return parse_values();
  if (keyword == "BA_") return parse_attribute();
  if (keyword == "CM_") return parse_comment();
  if (keyword == "VAL_TABLE_") return parse_value_table();
  if (keyword == "SIG_VALTYPE_") return parse_value_type();
  if (keyword == "SG_MUL_VAL_") return parse_extended_multiplexing();
  if (keyword == "BA_DEF_") return parse_attribute_definition();
  if (keyword == "BA_DEF_DEF_") return parse_attribute_default();
  skip_statement();
}

// NS_ lists keywords. The list ends before the keyword of the next statement, which is recognized by a
// following ':', quote or number: `BS_:`, `BU_:`, `BO_ 100`.
void DbcParser::parse_new_symbols() {
  if (!scanner_.accept(':')) return static_cast<void>(fail("':' after NS_"));
  while (true) {
    scanner_.skip_space();
    const std::size_t position = scanner_.position();
    if (scanner_.identifier().empty()) return;
    const char next = scanner_.peek();
    if (next == ':' || next == '"' || (next >= '0' && next <= '9')) return scanner_.move_to(position);
  }
}

// BS_: [baudrate : BTR1 , BTR2]
void DbcParser::parse_bit_timing() {
  if (!scanner_.accept(':')) return static_cast<void>(fail("':' after BS_"));
  if (!scanner_.number<double>()) return;
  if (!scanner_.accept(':')) return;
  if (!scanner_.number<double>() || !scanner_.accept(',') || !scanner_.number<double>())
    fail("the values of the bus timing registers");
}

void DbcParser::parse_nodes() {
  if (!scanner_.accept(':')) return static_cast<void>(fail("':' after BU_"));
  while (true) {
    const std::string_view node = scanner_.peek_identifier();
    if (node.empty() || is_dbc_keyword(node)) return;
    result_.database.nodes.emplace_back(scanner_.identifier());
    scanner_.accept(',');
  }
}

void DbcParser::parse_message() {
  signals_skipped_ = true;  // until the message has been parsed
  const auto file_id = scanner_.number<std::uint64_t>();
  if (!file_id) return static_cast<void>(fail("a message's identifier, 0 to 4294967295"));
  scanner_.skip_space();
  MessageNote note;
  note.position = scanner_.position();
  DbcMessage message;
  message.name = scanner_.identifier();
  message.short_name = message.name;
  if (message.name.empty()) return static_cast<void>(fail("a message's name"));
  if (!scanner_.accept(':')) return static_cast<void>(fail("':' after the message's name"));
  const auto length = scanner_.number<std::uint64_t>();
  if (!length) return static_cast<void>(fail("the message's length in bytes"));
  const std::string_view sender = scanner_.peek_identifier();
  if (sender.empty() || is_dbc_keyword(sender)) {
    report(Severity::error, statement_position_,
           "message '" + message.name + "' names no node that sends it");
  } else {
    message.sender = scanner_.identifier();
  }
  if (*file_id == pseudo_message_id) return;
  notes_.push_back(std::move(note));
  add_message(std::move(message), *file_id, *length);
}

void DbcParser::add_message(DbcMessage message, std::uint64_t file_id, std::uint64_t length) {
  const std::size_t index = result_.database.messages.size();
  const std::size_t position = notes_.back().position;
  message.is_extended = (file_id & extended_flag) != 0;
  message.id = static_cast<std::uint32_t>(file_id & ~std::uint64_t{extended_flag});
  message.length_bytes = static_cast<std::uint16_t>(std::min<std::uint64_t>(length, UINT16_MAX));
  result_.database.messages.push_back(std::move(message));
  DbcMessage& added = result_.database.messages.back();
  signals_wanted_ = true;
  signals_skipped_ = false;

  const std::string defect = identifier_defect(file_id);
  if (!defect.empty()) make_unusable(added, position, defect);
  if (length > CANFD_MAX_DLEN)
    make_unusable(added, position, "it has " + std::to_string(length) + " bytes, and a frame has at most 64");
  const auto share = [&](std::size_t earlier_index, const std::string& what) {
    DbcMessage& earlier = result_.database.messages[earlier_index];
    make_unusable(earlier, notes_[earlier_index].position, what + " message '" + added.name + "'");
    make_unusable(added, position, what + " message '" + earlier.name + "'");
  };
  const auto [same_id, is_new_id] = message_by_id_.emplace(static_cast<std::uint32_t>(file_id), index);
  if (!is_new_id && defect.empty()) share(same_id->second, "its identifier is also that of");
  const auto [same_name, is_new_name] = message_by_name_.emplace(added.name, index);
  if (!is_new_name) share(same_name->second, "its name is also that of another");
}

void DbcParser::parse_signal() {
  if (!signals_wanted_) {
    if (!signals_skipped_) report(Severity::error, statement_position_, "a signal outside of a message");
    return scanner_.skip_to_statement_line(statement_position_);
  }
  if (unknown_position_) {  // it may have been meant as another message
    result_.database.messages.back().unusable.push_back(
        "line " + std::to_string(lines_.place_of(*unknown_position_).line) +
        " of the DBC file, before one of its signals, is not understood");
    unknown_position_.reset();
  }
  DbcSignal signal;
  SignalNote note;
  std::string defect;
  scanner_.skip_space();
  note.position = scanner_.position();
  signal.name = scanner_.identifier();
  signal.short_name = signal.name;
  const bool is_understood = (!signal.name.empty() || fail("a signal's name")) &&
                             parse_multiplex_mark(signal, note) && parse_layout(signal, defect) &&
                             parse_scaling(signal, defect);
  if (is_understood) {
    skip_receivers();
    return add_signal(std::move(signal), note, defect);
  }
  result_.database.messages.back().unusable.push_back(
      "the signal in line " + std::to_string(lines_.place_of(statement_position_).line) +
      " of the DBC file is not understood");
}

void DbcParser::add_signal(DbcSignal signal, const SignalNote& note, const std::string& defect) {
  DbcMessage& message = result_.database.messages.back();
  if (!defect.empty()) return make_unusable(message, note.position, "signal '" + signal.name + "' " + defect);
  if (message.signals.size() >= max_signals) {
    if (message.signals.size() == max_signals && notes_.back().signal_by_name.contains(signal.name)) return;
    return make_unusable(message, note.position, "it has more than 2048 signals");
  }
  if (!notes_.back().signal_by_name.emplace(signal.name, message.signals.size()).second) {
    return make_unusable(message, note.position, "two of its signals are named '" + signal.name + "'");
  }
  message.signals.push_back(std::move(signal));
  notes_.back().signals.push_back(note);
}

// Receivers are names, separated by commas, or by blanks in one line.
void DbcParser::skip_receivers() {
  while (true) {
    const std::string_view receiver = scanner_.peek_identifier();
    if (receiver.empty() || is_dbc_keyword(receiver)) break;
    scanner_.identifier();
    if (!scanner_.accept(',') && scanner_.is_first_in_line()) break;
  }
  if (scanner_.at_end() || scanner_.is_first_in_line() || is_dbc_keyword(scanner_.peek_identifier())) return;
  report(Severity::warning, scanner_.position(), "what follows the signal's unit is no list of receivers");
  scanner_.skip_to_statement_line(scanner_.position());
}

// Nothing, "M", "m3", "m3M", or "m" if SG_MUL_VAL_ gives the values.
bool DbcParser::parse_multiplex_mark(DbcSignal& signal, SignalNote& note) {
  if (scanner_.peek() == ':') return scanner_.accept(':');
  const std::size_t position = scanner_.position();
  std::string_view mark = scanner_.identifier();
  if (mark.empty()) return fail("':' after the signal's name");
  if (mark.back() == 'M') {
    signal.is_multiplexer = true;
    mark.remove_suffix(1);
  }
  if (!mark.empty()) {
    note.multiplexed = true;
    std::uint64_t value = 0;
    const char* const end = mark.data() + mark.size();
    const auto [stop, fault] = std::from_chars(mark.data() + 1, end, value);
    if (mark.front() != 'm' || (mark.size() > 1 && (fault != std::errc{} || stop != end))) {
      scanner_.move_to(position);
      return fail("'M', 'm' with a number, or ':' after the signal's name");
    }
    if (mark.size() > 1) signal.multiplex_ranges.push_back({value, value});
  }
  return scanner_.accept(':') || fail("':' after the signal's name");
}

// start|length@order sign
bool DbcParser::parse_layout(DbcSignal& signal, std::string& defect) {
  const auto start = scanner_.number<std::uint64_t>();
  if (!start) return fail("a start bit");
  if (!scanner_.accept('|')) return fail("'|' after the start bit");
  const auto length = scanner_.number<std::uint64_t>();
  if (!length) return fail("a length in bits");
  if (!scanner_.accept('@')) return fail("'@' after the length");
  const char order = scanner_.peek();
  if (order != '0' && order != '1') return fail("byte order 0 (Motorola) or 1 (Intel)");
  scanner_.accept(order);
  const char sign = scanner_.peek();
  if (sign != '+' && sign != '-') return fail("'+' (unsigned) or '-' (signed)");
  scanner_.accept(sign);
  if (*length < 1 || *length > 64)
    defect = "has " + std::to_string(*length) + " bits, and a signal has 1 to 64";
  signal.start_bit = static_cast<std::uint16_t>(std::min<std::uint64_t>(*start, UINT16_MAX));
  signal.length_bits = static_cast<std::uint16_t>(std::min<std::uint64_t>(*length, UINT16_MAX));
  signal.order = order == '1' ? ByteOrder::intel : ByteOrder::motorola;
  signal.type = sign == '-' ? ValueType::signed_integer : ValueType::unsigned_integer;
  return true;
}

// (factor,offset) [minimum|maximum] "unit"
bool DbcParser::parse_scaling(DbcSignal& signal, std::string& defect) {
  const auto read = [&](char before, double& value, const char* what) {
    if (!scanner_.accept(before)) return fail(std::string("'") + before + "' before the " + what);
    const auto number = scanner_.number<double>();
    if (!number || !std::isfinite(*number)) return fail(std::string("a finite number as the ") + what);
    value = *number;
    return true;
  };
  if (!read('(', signal.factor, "factor") || !read(',', signal.offset, "offset")) return false;
  if (!scanner_.accept(')')) return fail("')' after the offset");
  if (!read('[', signal.minimum, "minimum") || !read('|', signal.maximum, "maximum")) return false;
  if (!scanner_.accept(']')) return fail("']' after the maximum");
  const auto unit = scanner_.quoted();
  if (!unit) return fail("the unit in double quotes");
  signal.unit = dbc_text(*unit);
  if (signal.factor == 0.0 && defect.empty()) defect = "has the factor 0";
  return true;
}

// CM_ [object] "text" ;
void DbcParser::parse_comment() {
  const std::string_view object = parse_object();
  if (!object.empty()) {
    if (object == "BO_" || object == "SG_") {
      if (!scanner_.number<std::uint32_t>()) return static_cast<void>(fail("a message's identifier"));
    }
    if (object != "BO_" && word().empty()) return static_cast<void>(fail("a name"));
  }
  if (!scanner_.quoted()) return static_cast<void>(fail("the comment in double quotes"));
  expect_semicolon();
}

// Skips the statement up to its ';', or up to a line that begins with a keyword.
void DbcParser::skip_statement() {
  while (!scanner_.accept(';')) {
    if (scanner_.at_end() || scanner_.at_statement_line()) return static_cast<void>(fail_unfinished());
    if (scanner_.peek() == '"') {
      if (!scanner_.quoted()) return static_cast<void>(fail_unfinished());
    } else if (scanner_.identifier().empty()) {
      scanner_.skip_byte();
    }
  }
}

void DbcParser::expect_semicolon() {
  if (!scanner_.accept(';')) fail_unfinished();
}

/// The identifier here; empty when there is none, or when it begins the next statement.
std::string_view DbcParser::word() {
  return scanner_.at_statement_line() ? std::string_view() : scanner_.identifier();
}

/// The kind of object that a comment or an attribute belongs to: BU_, BO_, SG_ or EV_. Empty: none of them.
std::string_view DbcParser::parse_object() {
  if (!is_dbc_object(scanner_.peek_identifier())) return {};
  object_may_be_statement_ = scanner_.at_statement_line();
  return scanner_.identifier();
}

DbcMessage* DbcParser::message_of_id(std::uint32_t file_id) {
  const auto found = message_by_id_.find(file_id);
  return found == message_by_id_.end() ? nullptr : &result_.database.messages[found->second];
}

void DbcParser::report_unknown_message(std::uint32_t file_id, std::size_t position) {
  if (file_id == pseudo_message_id) return;
  report(Severity::warning, position, "no message has the identifier " + std::to_string(file_id));
}

DbcSignal* DbcParser::signal_of(std::uint32_t file_id, std::string_view name, std::size_t position) {
  DbcMessage* const message = message_of_id(file_id);
  if (message == nullptr) {
    report_unknown_message(file_id, position);
    return nullptr;
  }
  const auto& signals = note_of(*message).signal_by_name;
  const auto found = signals.find(std::string(name));
  if (found == signals.end()) {
    report(Severity::warning, position,
           "message '" + message->name + "' has no signal '" + std::string(name) + "'");
    return nullptr;
  }
  return &message->signals[found->second];
}

/// Reports that the text here is not the expected one, and moves to the next statement. Returns false.
bool DbcParser::fail(std::string_view expected) {
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
  report(Severity::error, position,
         "expected " + std::string(expected) + ", found " + found + "; the statement is left out");
  scanner_.skip_to_statement_line(statement_position_);
  return false;
}

/// Reports that the statement ends without its ';', and moves to the next statement. Returns false.
bool DbcParser::fail_unfinished() {
  report(Severity::error, statement_position_, "this statement has no ';' at its end");
  if (!scanner_.at_statement_line() || object_may_be_statement_)
    scanner_.skip_to_statement_line(statement_position_);
  return false;
}

void DbcParser::make_unusable(DbcMessage& message, std::size_t position, const std::string& reason) {
  if (std::find(message.unusable.begin(), message.unusable.end(), reason) != message.unusable.end()) return;
  message.unusable.push_back(reason);
  report(Severity::unusable, position, "message '" + message.name + "' can not be used: " + reason);
}

void DbcParser::report(Severity severity, std::size_t position, std::string text) {
  ++(severity <= Severity::warning ? result_.warning_count : result_.error_count);
  if (severity == Severity::fatal) ++result_.fatal_count;
  if (severity != Severity::fatal && result_.problems.size() >= DbcResult::kept_problems) return;
  if (result_.problems.size() >= DbcResult::kept_problems) {
    result_.problems.pop_back();  // a fatal problem is always listed
    problem_positions_.pop_back();
  }
  result_.problems.push_back({severity, 0, 0, std::move(text)});
  problem_positions_.push_back(position);
}

/// Sets the lines and columns of the problems, in one pass over the text.
void DbcParser::locate_problems() {
  std::vector<std::size_t> order(problem_positions_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return problem_positions_[a] < problem_positions_[b]; });
  for (const std::size_t index : order) {
    const LineCounter::Place place = lines_.place_of(problem_positions_[index]);
    result_.problems[index].line = place.line;
    result_.problems[index].column = place.column;
  }
}

}  // namespace hil::io::can
