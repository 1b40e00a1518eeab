#include "io/can/dbc_parser.hpp"

#include <linux/can.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "io/can/dbc_completion.hpp"
#include "io/can/dbc_keywords.hpp"
#include "io/can/dbc_text.hpp"

namespace hil::io::can {

namespace {

using Severity = DbcProblem::Severity;

constexpr std::uint32_t extended_flag = 0x80000000U;
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

/// Sorts the ranges and joins those that overlap.
void merge_ranges(std::vector<MultiplexRange>& ranges) {
  std::sort(ranges.begin(), ranges.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::size_t kept = 0;
  for (const MultiplexRange& range : ranges) {
    if (kept > 0 && range.first <= ranges[kept - 1].last) {
      ranges[kept - 1].last = std::max(ranges[kept - 1].last, range.last);
    } else {
      ranges[kept++] = range;
    }
  }
  ranges.resize(kept);
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
  if (!is_blank && draft_.database.messages.empty())
    problems_.report(Severity::fatal, first_position,
                     "the file gives no message: it has no BO_ statement that is understood");
  DbcResult result;
  result.database = std::move(draft_.database);
  problems_.write_into(result, lines_);
  return result;
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
    draft_.database.nodes.emplace_back(scanner_.identifier());
    scanner_.accept(',');
  }
}

void DbcParser::parse_message() {
  signals_skipped_ = true;  // until the message has been parsed
  const auto file_id = scanner_.number<std::uint64_t>();
  if (!file_id) return static_cast<void>(fail("a message's identifier, 0 to 4294967295"));
  scanner_.skip_space();
  DbcMessageNote note;
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
    problems_.report(Severity::error, statement_position_,
                     "message '" + message.name + "' names no node that sends it");
  } else {
    message.sender = scanner_.identifier();
  }
  if (*file_id == pseudo_message_id) return;
  draft_.notes.push_back(std::move(note));
  add_message(std::move(message), *file_id, *length);
}

void DbcParser::add_message(DbcMessage message, std::uint64_t file_id, std::uint64_t length) {
  const std::size_t index = draft_.database.messages.size();
  const std::size_t position = draft_.notes.back().position;
  message.is_extended = (file_id & extended_flag) != 0;
  message.id = static_cast<std::uint32_t>(file_id & ~std::uint64_t{extended_flag});
  message.length_bytes = static_cast<std::uint16_t>(std::min<std::uint64_t>(length, UINT16_MAX));
  draft_.database.messages.push_back(std::move(message));
  DbcMessage& added = draft_.database.messages.back();
  signals_wanted_ = true;
  signals_skipped_ = false;

  const std::string defect = identifier_defect(file_id);
  if (!defect.empty()) problems_.make_unusable(added, position, defect);
  if (length > CANFD_MAX_DLEN)
    problems_.make_unusable(added, position,
                            "it has " + std::to_string(length) + " bytes, and a frame has at most 64");
  const auto share = [&](std::size_t earlier_index, const std::string& what) {
    DbcMessage& earlier = draft_.database.messages[earlier_index];
    problems_.make_unusable(earlier, draft_.notes[earlier_index].position,
                            what + " message '" + added.name + "'");
    problems_.make_unusable(added, position, what + " message '" + earlier.name + "'");
  };
  const auto [same_id, is_new_id] = draft_.message_by_id.emplace(static_cast<std::uint32_t>(file_id), index);
  if (!is_new_id && defect.empty()) share(same_id->second, "its identifier is also that of");
  const auto [same_name, is_new_name] = draft_.message_by_name.emplace(added.name, index);
  if (!is_new_name) share(same_name->second, "its name is also that of another");
}

void DbcParser::parse_signal() {
  if (!signals_wanted_) {
    if (!signals_skipped_)
      problems_.report(Severity::error, statement_position_, "a signal outside of a message");
    return scanner_.skip_to_statement_line(statement_position_);
  }
  if (unknown_position_) {  // it may have been meant as another message
    draft_.database.messages.back().unusable.push_back(
        "line " + std::to_string(lines_.place_of(*unknown_position_).line) +
        " of the DBC file, before one of its signals, is not understood");
    unknown_position_.reset();
  }
  DbcSignal signal;
  DbcSignalNote note;
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
  draft_.database.messages.back().unusable.push_back(
      "the signal in line " + std::to_string(lines_.place_of(statement_position_).line) +
      " of the DBC file is not understood");
}

void DbcParser::add_signal(DbcSignal signal, const DbcSignalNote& note, const std::string& defect) {
  DbcMessage& message = draft_.database.messages.back();
  if (!defect.empty())
    return problems_.make_unusable(message, note.position, "signal '" + signal.name + "' " + defect);
  if (message.signals.size() >= max_signals) {
    if (message.signals.size() == max_signals && draft_.notes.back().signal_by_name.contains(signal.name))
      return;
    return problems_.make_unusable(message, note.position, "it has more than 2048 signals");
  }
  if (!draft_.notes.back().signal_by_name.emplace(signal.name, message.signals.size()).second) {
    return problems_.make_unusable(message, note.position,
                                   "two of its signals are named '" + signal.name + "'");
  }
  message.signals.push_back(std::move(signal));
  draft_.notes.back().signals.push_back(note);
}

// Nothing, "M", "m3", "m3M", or "m" if SG_MUL_VAL_ gives the values.
bool DbcParser::parse_multiplex_mark(DbcSignal& signal, DbcSignalNote& note) {
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

void DbcParser::parse_value_table() {
  const std::string_view name = word();
  if (name.empty()) return static_cast<void>(fail("the name of a value table"));
  std::map<std::int64_t, std::string> values;
  if (parse_value_list(values))
    draft_.database.value_tables.insert_or_assign(std::string(name), std::move(values));
}

void DbcParser::parse_values() {
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) {  // values of an environment variable
    if (word().empty()) return static_cast<void>(fail("a message's identifier"));
    return skip_statement();
  }
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  const std::string_view name = word();
  if (name.empty()) return static_cast<void>(fail("a signal's name"));
  std::map<std::int64_t, std::string> values;
  if (!parse_value_list(values)) return;
  if (DbcSignal* signal = draft_.find_signal(*id, name, position, problems_))
    signal->value_names = std::move(values);
}

// SIG_VALTYPE_ id signal : 1 ;
void DbcParser::parse_value_type() {
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) return static_cast<void>(fail("a message's identifier"));
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  const std::string_view name = word();
  DbcSignal* const signal = name.empty() ? nullptr : draft_.find_signal(*id, name, position, problems_);
  scanner_.accept(':');
  const auto kind = scanner_.number<std::uint32_t>();
  if (name.empty() || !kind || *kind > 2) {
    // Without this statement the signals of the message would be decoded wrongly.
    if (DbcMessage* const message = draft_.message_of_id(*id))
      message->unusable.emplace_back("a SIG_VALTYPE_ statement of it is not understood");
    return static_cast<void>(fail(name.empty() ? "a signal's name" : "0 (integer), 1 (float) or 2 (double)"));
  }
  expect_semicolon();
  if (signal == nullptr || *kind == 0) return;
  if (signal->length_bits != 32 * *kind) {
    return problems_.make_unusable(*draft_.message_of_id(*id), position,
                                   "signal '" + signal->name + "' has " +
                                       std::to_string(signal->length_bits) + " bits, and a " +
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
  const std::string_view name = word();
  scanner_.skip_space();
  const std::size_t switch_position = scanner_.position();
  const std::string_view switch_name = name.empty() ? name : word();
  std::vector<MultiplexRange> ranges;
  const auto read_ranges = [&] {
    if (name.empty()) return fail("the name of the multiplexed signal");
    if (switch_name.empty()) return fail("the name of the multiplexer signal");
    do {
      const auto first = scanner_.number<std::uint64_t>();
      if (!first || !scanner_.accept('-')) return fail("a range of multiplexer values such as 3-5");
      const auto last = scanner_.number<std::uint64_t>();
      if (!last || *last < *first) return fail("the last value of the range, not below the first");
      ranges.push_back({*first, *last});
    } while (scanner_.accept(','));
    return true;
  };
  if (!read_ranges()) {
    if (DbcMessage* const message = draft_.message_of_id(*id))
      message->unusable.emplace_back("a SG_MUL_VAL_ statement of it is not understood");
    return;
  }
  expect_semicolon();
  DbcSignal* const selected = draft_.find_signal(*id, name, position, problems_);
  DbcSignal* const selector = draft_.find_signal(*id, switch_name, switch_position, problems_);
  if (selected == nullptr || selector == nullptr) return;
  DbcMessage& message = *draft_.message_of_id(*id);
  if (selected == selector)
    return problems_.make_unusable(message, switch_position,
                                   "signal '" + selected->name + "' selects itself");
  const auto index_of = [&](const DbcSignal* signal) {
    return static_cast<std::size_t>(signal - message.signals.data());
  };
  bool& has_ranges = draft_.note_of(message).signals[index_of(selected)].has_extended_ranges;
  if (has_ranges && selected->multiplexer != static_cast<int>(index_of(selector)))
    return problems_.make_unusable(message, switch_position,
                                   "signal '" + selected->name + "' is selected by two multiplexers");
  if (!has_ranges) selected->multiplex_ranges.clear();
  selected->multiplex_ranges.insert(selected->multiplex_ranges.end(), ranges.begin(), ranges.end());
  merge_ranges(selected->multiplex_ranges);
  selected->multiplexer = static_cast<int>(index_of(selector));
  selector->is_multiplexer = true;
  has_ranges = true;
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

// BA_DEF_ [object] "name" type ... ;
void DbcParser::parse_attribute_definition() {
  parse_object();
  const auto name = scanner_.quoted();
  if (!name) return static_cast<void>(fail("an attribute's name in double quotes"));
  std::vector<std::string>& words = attributes_.words_of(dbc_text(*name));
  if (scanner_.peek_identifier() != "ENUM") return skip_statement();
  scanner_.identifier();
  words.clear();
  do {
    const auto word = scanner_.quoted();
    if (!word) return skip_statement();
    words.push_back(dbc_text(*word));
  } while (scanner_.accept(','));
  expect_semicolon();
}

// BA_DEF_DEF_ "name" value ;
void DbcParser::parse_attribute_default() {
  const auto name = scanner_.quoted();
  if (!name) return static_cast<void>(fail("an attribute's name in double quotes"));
  auto value = parse_attribute_value();
  if (!value) return static_cast<void>(fail("the attribute's default value"));
  expect_semicolon();
  attributes_.set_default(dbc_text(*name), *std::move(value));
}

// BA_ "name" [object] value ;
void DbcParser::parse_attribute() {
  const auto name = scanner_.quoted();
  if (!name) return static_cast<void>(fail("an attribute's name in double quotes"));
  const std::string_view object = parse_object();
  std::uint32_t id = 0;
  std::string_view owner;
  if (!object.empty()) {
    if (object == "BO_" || object == "SG_") {
      const auto number = scanner_.number<std::uint32_t>();
      if (!number) return static_cast<void>(fail("a message's identifier"));
      id = *number;
    }
    if (object != "BO_") owner = word();
    if (object != "BO_" && owner.empty()) return static_cast<void>(fail("a name"));
  }
  const auto value = parse_attribute_value();
  if (!value) return static_cast<void>(fail("the attribute's value"));
  expect_semicolon();
  if (object == "BO_") attributes_.set_of_message(*name, id, *value, statement_position_, draft_, problems_);
  if (object == "SG_")
    attributes_.set_of_signal(*name, id, owner, *value, statement_position_, draft_, problems_);
  if (object == "BU_") attributes_.set_of_node(*name, owner, *value);
}

void DbcParser::complete_messages() {
  std::uint64_t overlap_steps = 0;
  for (std::size_t index = 0; index < draft_.notes.size(); ++index) {
    DbcMessage& message = draft_.database.messages[index];
    attributes_.apply_to(message, draft_.notes[index], problems_);
    link_multiplexers(message, draft_.notes[index], problems_);
    find_overlaps(message, draft_.notes[index], overlap_steps, problems_);
  }
  attributes_.apply_long_names(draft_, problems_);
}

}  // namespace hil::io::can
