#include "io/can/dbc_parser.hpp"

#include <linux/can.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace hil::io::can {

namespace {

constexpr std::uint32_t extended_flag = 0x80000000U;
constexpr std::uint32_t pseudo_message_id = 0xC0000000U;  // VECTOR__INDEPENDENT_SIG_MSG: signals of no frame
constexpr std::size_t most_signals = 2048;  // of one message; more is a mistake, and would be slow to check

bool is_utf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const auto lead = static_cast<unsigned char>(text[at]);
    const std::size_t length = lead < 0x80                   ? 1
                               : lead >= 0xC2 && lead < 0xE0 ? 2
                               : lead >= 0xE0 && lead < 0xF0 ? 3
                               : lead >= 0xF0 && lead < 0xF5 ? 4
                                                             : 0;
    if (length == 0 || at + length > text.size()) return false;
    for (std::size_t next = 1; next < length; ++next) {
      if ((static_cast<unsigned char>(text[at + next]) & 0xC0U) != 0x80) return false;
    }
    at += length;
  }
  return true;
}

/// Units come from old editors: what is not UTF-8 is read as Latin-1.
std::string as_utf8(std::string_view text) {
  if (is_utf8(text)) return std::string(text);
  std::string converted;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      converted.push_back(c);
    } else {
      converted.push_back(static_cast<char>(0xC0U | (byte >> 6U)));
      converted.push_back(static_cast<char>(0x80U | (byte & 0x3FU)));
    }
  }
  return converted;
}

bool is_passed_over(std::string_view keyword) {
  static constexpr std::array words = {
      "CM_",       "BA_DEF_",    "BA_DEF_REL_",  "BA_REL_",          "BA_DEF_DEF_REL_",
      "BO_TX_BU_", "EV_",        "ENVVAR_DATA_", "SGTYPE_",          "SIG_GROUP_",
      "CAT_",      "CAT_DEF_",   "FILTER",       "SIGTYPE_VALTYPE_", "SIG_TYPE_REF_",
      "EV_DATA_",  "BU_SG_REL_", "BU_EV_REL_",   "BU_BO_REL_"};
  return std::find(words.begin(), words.end(), keyword) != words.end();
}

bool is_keyword(std::string_view word) {
  static constexpr std::array understood = {"VERSION",    "NS_",          "BS_",         "BU_",
                                            "BO_",        "SG_",          "VAL_",        "BA_",
                                            "VAL_TABLE_", "SIG_VALTYPE_", "SG_MUL_VAL_", "BA_DEF_DEF_"};
  return std::find(understood.begin(), understood.end(), word) != understood.end() || is_passed_over(word);
}

}  // namespace

DbcResult DbcParser::parse() {
  if (text_.substr(0, 3) == "\xEF\xBB\xBF") scanner_.move_to(3);
  while (scanner_.peek() != '\0' || !scanner_.at_end()) {
    const std::size_t position = scanner_.position();
    const std::string_view keyword = scanner_.identifier();
    if (keyword.empty()) {
      fail("a DBC keyword");
      continue;
    }
    parse_statement(keyword, position);
  }
  complete_messages();
  return std::move(result_);
}

void DbcParser::parse_statement(std::string_view keyword, std::size_t keyword_position) {
  if (keyword == "SG_") return parse_signal(keyword_position);
  signals_wanted_ = false;
  signals_passed_over_ = false;
  if (keyword == "BO_") return parse_message();
  if (keyword == "VAL_") return parse_values();
  if (keyword == "BA_") return parse_attribute();
  if (keyword == "VERSION") {
    if (!scanner_.quoted()) fail("the version in double quotes");
    return;
  }
  if (keyword == "NS_") return parse_new_symbols();
  if (keyword == "BS_") return scanner_.skip_line();
  if (keyword == "BU_") return parse_nodes();
  if (keyword == "VAL_TABLE_") return parse_value_table();
  if (keyword == "SIG_VALTYPE_") return parse_value_type();
  if (keyword == "SG_MUL_VAL_") return parse_extended_multiplexing();
  if (keyword == "BA_DEF_DEF_") return parse_attribute_default();
  if (is_passed_over(keyword)) return pass_over(keyword_position);
  scanner_.move_to(keyword_position);
  fail("a DBC keyword");
}

// NS_ lists keywords, indented, until a word starts in the first column.
void DbcParser::parse_new_symbols() {
  if (!scanner_.accept(':')) return static_cast<void>(fail("':' after NS_"));
  scanner_.skip_line();
  while (!scanner_.at_end()) {
    const char first = text_[scanner_.position()];
    if (first != ' ' && first != '\t' && first != '\r' && first != '\n') return;
    scanner_.skip_line();
  }
}

// Names up to the next statement; some tools write one a line.
void DbcParser::parse_nodes() {
  if (!scanner_.accept(':')) return static_cast<void>(fail("':' after BU_"));
  while (true) {
    scanner_.skip_space();
    const std::size_t position = scanner_.position();
    const std::string_view node = scanner_.identifier();
    if (node.empty() || is_keyword(node)) return scanner_.move_to(position);
    result_.database.nodes.emplace_back(node);
  }
}

void DbcParser::parse_message() {
  signals_passed_over_ = true;  // until the message turns out to be good
  scanner_.skip_space();
  const std::size_t id_position = scanner_.position();
  const auto file_id = scanner_.number<std::uint32_t>();
  if (!file_id) return static_cast<void>(fail("a message's identifier, 0 to 4294967295"));
  scanner_.skip_space();
  const std::size_t name_position = scanner_.position();
  DbcMessage message;
  message.name = scanner_.identifier();
  if (message.name.empty()) return static_cast<void>(fail("a message's name"));
  if (!scanner_.accept(':')) return static_cast<void>(fail("':' after the message's name"));
  const auto length = scanner_.number<std::uint32_t>();
  if (!length) return static_cast<void>(fail("the message's length in bytes"));
  message.sender = scanner_.identifier();
  if (message.sender.empty()) return static_cast<void>(fail("the node that sends the message"));
  if (*file_id == pseudo_message_id) return;

  message.is_extended = (*file_id & extended_flag) != 0;
  message.id = *file_id & ~extended_flag;
  message.length_bytes = static_cast<std::uint16_t>(std::min<std::uint32_t>(*length, CANFD_MAX_DLEN));
  const auto error = DbcProblem::Severity::error;
  message.id_fits = message.id <= (message.is_extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  if (!message.id_fits) {
    report(DbcProblem::Severity::warning, id_position,
           "identifier " + std::to_string(*file_id) + " of message '" + message.name + "' does not fit in " +
               (message.is_extended ? "29" : "11") + " bits");
  }
  if (*length > CANFD_MAX_DLEN) {
    return report(
        error, name_position,
        "message '" + message.name + "' has " + std::to_string(*length) + " bytes; a frame has at most 64");
  }
  if (message_by_id_.contains(*file_id)) {
    return report(error, id_position,
                  "a second message with the identifier of '" +
                      result_.database.messages[message_by_id_[*file_id]].name + "'");
  }
  if (!message_by_name_.emplace(message.name, result_.database.messages.size()).second) {
    return report(error, name_position, "a second message named '" + message.name + "'");
  }
  message_by_id_.emplace(*file_id, result_.database.messages.size());
  result_.database.messages.push_back(std::move(message));
  notes_.emplace_back();
  signals_wanted_ = true;
  signals_passed_over_ = false;
}

void DbcParser::parse_signal(std::size_t keyword_position) {
  if (!signals_wanted_) {
    if (!signals_passed_over_)
      report(DbcProblem::Severity::error, keyword_position, "a signal outside of a message");
    return scanner_.skip_line();
  }
  DbcMessage& message = result_.database.messages.back();
  DbcSignal signal;
  SignalNote note;
  scanner_.skip_space();
  note.position = scanner_.position();
  signal.name = scanner_.identifier();
  if (signal.name.empty()) return static_cast<void>(fail("a signal's name"));
  if (!parse_multiplex_mark(signal, note) || !parse_layout(signal) || !parse_scaling(signal)) return;
  scanner_.skip_line();  // the receivers
  const auto error = DbcProblem::Severity::error;
  if (message.signals.size() >= most_signals) {
    return report(error, note.position, "message '" + message.name + "' has more than 2048 signals");
  }
  if (message.find_signal(signal.name) != nullptr) {
    return report(error, note.position,
                  "a second signal named '" + signal.name + "' in message '" + message.name + "'");
  }
  message.signals.push_back(std::move(signal));
  notes_.back().signals.push_back(note);
}

// Nothing, "M", "m3" or "m3M".
bool DbcParser::parse_multiplex_mark(DbcSignal& signal, SignalNote& note) {
  if (scanner_.peek() == ':') return scanner_.accept(':');
  const std::size_t position = scanner_.position();
  std::string_view mark = scanner_.identifier();
  if (!mark.empty() && mark.back() == 'M') {
    signal.is_multiplexer = true;
    mark.remove_suffix(1);
  }
  if (!mark.empty()) {
    std::uint64_t value = 0;
    const char* const end = mark.data() + mark.size();
    const auto [stop, fault] = std::from_chars(mark.data() + 1, end, value);
    if (mark.front() != 'm' || fault != std::errc{} || stop != end) {
      scanner_.move_to(position);
      return fail("'M', 'm' with a number, or ':' after the signal's name");
    }
    note.multiplexed = true;
    signal.multiplex_ranges.push_back({value, value});
  } else if (!signal.is_multiplexer) {
    return fail("':' after the signal's name");
  }
  return scanner_.accept(':') || fail("':' after the signal's name");
}

// start|length@order sign
bool DbcParser::parse_layout(DbcSignal& signal) {
  const auto start = scanner_.number<std::uint32_t>();
  if (!start || *start > 65535) return fail("a start bit");
  if (!scanner_.accept('|')) return fail("'|' after the start bit");
  scanner_.skip_space();
  const std::size_t length_position = scanner_.position();
  const auto length = scanner_.number<std::uint32_t>();
  if (!length || *length < 1 || *length > 64) {
    scanner_.move_to(length_position);
    return fail("a length of 1 to 64 bits");
  }
  if (!scanner_.accept('@')) return fail("'@' after the length");
  const char order = scanner_.peek();
  if (order != '0' && order != '1') return fail("byte order 0 (Motorola) or 1 (Intel)");
  scanner_.accept(order);
  const char sign = scanner_.peek();
  if (sign != '+' && sign != '-') return fail("'+' (unsigned) or '-' (signed)");
  scanner_.accept(sign);
  signal.start_bit = static_cast<std::uint16_t>(*start);
  signal.length_bits = static_cast<std::uint16_t>(*length);
  signal.order = order == '1' ? ByteOrder::intel : ByteOrder::motorola;
  signal.type = sign == '-' ? ValueType::signed_integer : ValueType::unsigned_integer;
  return true;
}

// (factor,offset) [minimum|maximum] "unit"
bool DbcParser::parse_scaling(DbcSignal& signal) {
  const auto read = [&](char before, double& value, const char* what) {
    if (!scanner_.accept(before)) return fail(std::string("'") + before + "' before the " + what);
    const auto number = scanner_.number<double>();
    if (!number || !std::isfinite(*number)) return fail(std::string("a finite number as the ") + what);
    value = *number;
    return true;
  };
  if (!read('(', signal.factor, "factor") || !read(',', signal.offset, "offset")) return false;
  if (!scanner_.accept(')')) return fail("')' after the offset");
  if (signal.factor == 0.0) return fail("a factor that is not zero");
  if (!read('[', signal.minimum, "minimum") || !read('|', signal.maximum, "maximum")) return false;
  if (!scanner_.accept(']')) return fail("']' after the maximum");
  const auto unit = scanner_.quoted();
  if (!unit) return fail("the unit in double quotes");
  signal.unit = as_utf8(*unit);
  return true;
}

void DbcParser::parse_value_table() {
  const std::string_view name = scanner_.identifier();
  if (name.empty()) return static_cast<void>(fail("the name of a value table"));
  std::map<std::int64_t, std::string> values;
  if (parse_value_list(values))
    result_.database.value_tables.insert_or_assign(std::string(name), std::move(values));
}

void DbcParser::parse_values() {
  scanner_.skip_space();
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) {  // values of an environment variable
    if (scanner_.identifier().empty()) return static_cast<void>(fail("a message's identifier"));
    return pass_over(scanner_.position());
  }
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  const std::string_view name = scanner_.identifier();
  if (name.empty()) return static_cast<void>(fail("a signal's name"));
  std::map<std::int64_t, std::string> values;
  if (!parse_value_list(values)) return;
  if (DbcSignal* signal = signal_of(*id, name, position)) signal->value_names = std::move(values);
}

bool DbcParser::parse_value_list(std::map<std::int64_t, std::string>& values) {
  while (!scanner_.accept(';')) {
    const auto value = scanner_.number<double>();
    if (!value || std::abs(*value) > 9.2e18) return fail("a value, or ';' at the end of the list");
    const auto text = scanner_.quoted();
    if (!text) return fail("the value's name in double quotes");
    values.insert_or_assign(static_cast<std::int64_t>(*value), as_utf8(*text));
  }
  return true;
}

void DbcParser::parse_value_type() {
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) return static_cast<void>(fail("a message's identifier"));
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  const std::string_view name = scanner_.identifier();
  if (name.empty()) return static_cast<void>(fail("a signal's name"));
  scanner_.accept(':');
  const auto kind = scanner_.number<std::uint32_t>();
  if (!kind || *kind > 2) return static_cast<void>(fail("0 (integer), 1 (float) or 2 (double)"));
  if (!scanner_.accept(';')) return static_cast<void>(fail("';'"));
  DbcSignal* signal = signal_of(*id, name, position);
  if (signal == nullptr || *kind == 0) return;
  if (signal->length_bits != 32 * *kind) {
    return report(DbcProblem::Severity::error, position,
                  "signal '" + signal->name + "' has " + std::to_string(signal->length_bits) + " bits; a " +
                      (*kind == 1 ? "float has 32" : "double has 64"));
  }
  signal->type = *kind == 1 ? ValueType::float32 : ValueType::float64;
}

// SG_MUL_VAL_ id signal switch first-last, first-last ;
void DbcParser::parse_extended_multiplexing() {
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) return static_cast<void>(fail("a message's identifier"));
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  const std::string_view name = scanner_.identifier();
  if (name.empty()) return static_cast<void>(fail("the name of the multiplexed signal"));
  scanner_.skip_space();
  const std::size_t switch_position = scanner_.position();
  const std::string_view switch_name = scanner_.identifier();
  if (switch_name.empty()) return static_cast<void>(fail("the name of the multiplexer signal"));
  std::vector<MultiplexRange> ranges;
  do {
    const auto first = scanner_.number<std::uint64_t>();
    if (!first || !scanner_.accept('-'))
      return static_cast<void>(fail("a range of switch values such as 3-5"));
    const auto last = scanner_.number<std::uint64_t>();
    if (!last || *last < *first)
      return static_cast<void>(fail("the last value of the range, not below the first"));
    ranges.push_back({*first, *last});
  } while (scanner_.accept(','));
  if (!scanner_.accept(';')) return static_cast<void>(fail("';'"));
  DbcSignal* const selected = signal_of(*id, name, position);
  DbcSignal* const selector = signal_of(*id, switch_name, switch_position);
  if (selected == nullptr || selector == nullptr) return;
  if (selected == selector) {
    return report(DbcProblem::Severity::error, switch_position,
                  "signal '" + selected->name + "' selects itself");
  }
  const std::size_t message_index = message_by_id_[*id];
  selected->multiplexer =
      static_cast<int>(selector - result_.database.messages[message_index].signals.data());
  selected->multiplex_ranges = std::move(ranges);
  selector->is_multiplexer = true;
  notes_[message_index].has_extended_ranges = true;
}

void DbcParser::parse_attribute() {
  const std::size_t position = scanner_.position();
  const auto attribute = scanner_.quoted();
  if (!attribute) return static_cast<void>(fail("an attribute's name in double quotes"));
  if (*attribute != "GenMsgCycleTime" || scanner_.identifier() != "BO_") return pass_over(position);
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) return static_cast<void>(fail("a message's identifier"));
  const auto value = scanner_.number<double>();
  if (!value || !(*value >= 0.0 && *value < 1e9))
    return static_cast<void>(fail("a cycle time in milliseconds"));
  if (!scanner_.accept(';')) return static_cast<void>(fail("';'"));
  if (DbcMessage* message = message_of_id(*id)) {
    message->cycle_time_ms = static_cast<std::int64_t>(std::llround(*value));
    has_cycle_time_.push_back(*id);
  } else if (*id != pseudo_message_id) {
    report(DbcProblem::Severity::warning, position, "no message has the identifier " + std::to_string(*id));
  }
}

void DbcParser::parse_attribute_default() {
  const std::size_t position = scanner_.position();
  const auto attribute = scanner_.quoted();
  if (!attribute) return static_cast<void>(fail("an attribute's name in double quotes"));
  if (*attribute != "GenMsgCycleTime") return pass_over(position);
  const auto value = scanner_.number<double>();
  if (!value || !(*value >= 0.0 && *value < 1e9))
    return static_cast<void>(fail("a cycle time in milliseconds"));
  if (!scanner_.accept(';')) return static_cast<void>(fail("';'"));
  default_cycle_time_ms_ = static_cast<std::int64_t>(std::llround(*value));
}

void DbcParser::pass_over(std::size_t keyword_position) {
  if (scanner_.skip_statement()) return;
  report(DbcProblem::Severity::error, keyword_position, "this statement has no ';' at its end");
  scanner_.skip_line();
}

DbcMessage* DbcParser::message_of_id(std::uint32_t file_id) {
  const auto found = message_by_id_.find(file_id);
  return found == message_by_id_.end() ? nullptr : &result_.database.messages[found->second];
}

DbcSignal* DbcParser::signal_of(std::uint32_t file_id, std::string_view name, std::size_t position) {
  if (file_id == pseudo_message_id) return nullptr;
  const auto warning = DbcProblem::Severity::warning;
  DbcMessage* const message = message_of_id(file_id);
  if (message == nullptr) {
    report(warning, position, "no message has the identifier " + std::to_string(file_id));
    return nullptr;
  }
  const DbcSignal* const signal = message->find_signal(name);
  if (signal == nullptr) {
    report(warning, position, "message '" + message->name + "' has no signal '" + std::string(name) + "'");
    return nullptr;
  }
  return &message->signals[static_cast<std::size_t>(signal - message->signals.data())];
}

bool DbcParser::fail(std::string_view expected) {
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  if (result_.problems.size() < DbcResult::kept_problems) {
    std::string found = scanner_.at_end() ? "the end of the file" : "'";
    for (std::size_t at = position; at < text_.size() && at < position + 20; ++at) {
      const char c = text_[at];
      if (c == '\n' || c == '\r') break;
      found.push_back(c >= ' ' && c <= '~' ? c : '?');
    }
    if (!scanner_.at_end()) found.push_back('\'');
    report(DbcProblem::Severity::error, position, "expected " + std::string(expected) + ", found " + found);
  } else {
    ++result_.error_count;
  }
  scanner_.skip_line();
  return false;
}

void DbcParser::report(DbcProblem::Severity severity, std::size_t position, std::string text) {
  ++(severity == DbcProblem::Severity::error ? result_.error_count : result_.warning_count);
  if (result_.problems.size() >= DbcResult::kept_problems) return;
  const LineCounter::Place place = lines_.place_of(position);
  result_.problems.push_back({severity, place.line, place.column, std::move(text)});
}

}  // namespace hil::io::can
