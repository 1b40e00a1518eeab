// The attributes of a DBC file that determine how messages are transmitted, and the long names.

#include <linux/can.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "io/can/dbc_parser.hpp"
#include "io/can/dbc_text.hpp"

namespace hil::io::can {

namespace {

bool is_identifier(std::string_view name) {
  DbcScanner scanner(name);
  return !name.empty() && scanner.identifier() == name;
}

}  // namespace

// BA_DEF_ [object] "name" type ... ;
void DbcParser::parse_attribute_definition() {
  parse_object();
  const auto name = scanner_.quoted();
  if (!name) return static_cast<void>(fail("an attribute's name in double quotes"));
  AttributeDefinition& definition = attributes_[dbc_text(*name)];
  if (scanner_.peek_identifier() != "ENUM") return skip_statement();
  scanner_.identifier();
  definition.words.clear();
  do {
    const auto word = scanner_.quoted();
    if (!word) return skip_statement();
    definition.words.push_back(dbc_text(*word));
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
  attributes_[dbc_text(*name)].initial = std::move(value);
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
  if (object == "BO_") take_message_attribute(*name, id, *value);
  if (object == "SG_") take_signal_attribute(*name, id, owner, *value);
  if (object == "BU_" && *name == "SystemNodeLongSymbol" && is_identifier(value->text))
    long_node_names_.insert_or_assign(std::string(owner), value->text);
}

std::optional<DbcParser::AttributeValue> DbcParser::parse_attribute_value() {
  AttributeValue value;
  if (const auto text = scanner_.quoted()) {
    value.text = dbc_text(*text);
    return value;
  }
  value.number = scanner_.number<double>();
  if (!value.number) return std::nullopt;
  return value;
}

/// The value as a number, also if it is written as a string. Empty: it is not a finite number.
std::optional<double> DbcParser::number_of(const AttributeValue& value) const {
  if (value.number && std::isfinite(*value.number)) return value.number;
  if (value.number || value.text.empty()) return std::nullopt;
  double number = 0.0;
  const char* const end = value.text.data() + value.text.size();
  const auto [stop, fault] = std::from_chars(value.text.data(), end, number);
  if (fault != std::errc{} || stop != end || !std::isfinite(number)) return std::nullopt;
  return number;
}

/// Empty unless it is a number of milliseconds below 1e9.
std::optional<std::int64_t> DbcParser::cycle_time_of(const AttributeValue& value) const {
  const auto cycle_time_ms = number_of(value);
  if (!cycle_time_ms || !(*cycle_time_ms >= 0.0 && *cycle_time_ms < 1e9)) return std::nullopt;
  return std::llround(*cycle_time_ms);
}

void DbcParser::take_message_attribute(std::string_view name, std::uint32_t file_id,
                                       const AttributeValue& value) {
  constexpr std::string_view used[] = {"VFrameFormat", "CANFD_BRS", "SystemMessageLongSymbol",
                                       "GenMsgCycleTime"};
  if (std::ranges::find(used, name) == std::end(used)) return;
  DbcMessage* const message = message_of_id(file_id);
  if (message == nullptr) return report_unknown_message(file_id, statement_position_);
  MessageNote& note = note_of(*message);
  if (name == "VFrameFormat") note.frame_format = value;
  if (name == "CANFD_BRS") note.bit_rate_switch = value;
  if (name == "SystemMessageLongSymbol") note.long_name = value.text;
  if (name != "GenMsgCycleTime") return;
  const auto cycle_time_ms = cycle_time_of(value);
  if (!cycle_time_ms) {
    return report(Severity::error, statement_position_,
                  "the GenMsgCycleTime of message '" + message->name +
                      "' is not a number of milliseconds from 0 to 1e9");
  }
  message->cycle_time_ms = *cycle_time_ms;
  note.has_cycle_time = true;
}

void DbcParser::take_signal_attribute(std::string_view name, std::uint32_t file_id, std::string_view signal,
                                      const AttributeValue& value) {
  const bool is_start = name == "GenSigStartValue";
  if (!is_start && name != "SystemSignalLongSymbol") return;
  DbcSignal* const found = signal_of(file_id, signal, statement_position_);
  if (found == nullptr) return;
  if (is_start) {
    found->start_raw = number_of(value);
  } else {
    DbcMessage& message = *message_of_id(file_id);
    note_of(message).long_signal_names.emplace_back(static_cast<std::size_t>(found - message.signals.data()),
                                                    value.text);
  }
}

/// The format that a value of VFrameFormat denotes. A number for which the definition has no word has
/// Vector's meaning.
DbcParser::FrameFormat DbcParser::format_of(const AttributeValue& value) {
  const std::vector<std::string>& words = attributes_["VFrameFormat"].words;
  std::string word = value.text;
  if (value.number) {
    const double number = *value.number;
    if (number >= 0.0 && number < static_cast<double>(words.size()))
      word = words[static_cast<std::size_t>(number)];
    const bool is_reserved = word.empty() || word == "reserved";
    if (is_reserved && (number == 14.0 || number == 15.0)) return FrameFormat::fd;
    if (is_reserved && number == 3.0) return FrameFormat::j1939;
    if (is_reserved && (number == 0.0 || number == 1.0)) return FrameFormat::classic;
  }
  if (word.ends_with("_FD")) return FrameFormat::fd;
  if (word.starts_with("J1939")) return FrameFormat::j1939;
  return word == "StandardCAN" || word == "ExtendedCAN" ? FrameFormat::classic : FrameFormat::unstated;
}

bool DbcParser::switches_bit_rate(const AttributeValue& value) {
  const std::vector<std::string>& words = attributes_["CANFD_BRS"].words;
  const auto number = number_of(value);
  if (value.number && *value.number >= 0.0 && *value.number < static_cast<double>(words.size()))
    return words[static_cast<std::size_t>(*value.number)] == "1";
  return number ? *number != 0.0 : value.text == "on" || value.text == "true";
}

void DbcParser::apply_attributes(DbcMessage& message, const MessageNote& note) {
  const auto initial = [&](const char* attribute) -> const std::optional<AttributeValue>& {
    return attributes_[attribute].initial;
  };
  if (!note.has_cycle_time && initial("GenMsgCycleTime")) {
    const auto cycle_time_ms = cycle_time_of(*initial("GenMsgCycleTime"));
    if (cycle_time_ms) message.cycle_time_ms = *cycle_time_ms;
  }
  if (initial("GenSigStartValue")) {
    const auto start_raw = number_of(*initial("GenSigStartValue"));
    for (DbcSignal& signal : message.signals) {
      if (signal.start_raw || !start_raw) continue;
      signal.start_raw = start_raw;
      signal.start_is_default = true;
    }
  }
  const auto& written = note.frame_format ? note.frame_format : initial("VFrameFormat");
  const FrameFormat format = written ? format_of(*written) : FrameFormat::unstated;
  const bool is_long = message.length_bytes > CAN_MAX_DLEN;
  if (is_long && note.frame_format && (format == FrameFormat::classic || format == FrameFormat::j1939)) {
    const std::string length = "it has " + std::to_string(message.length_bytes) + " bytes, and ";
    make_unusable(message, note.position,
                  format == FrameFormat::classic
                      ? length + "a frame that is not CAN FD (VFrameFormat) has at most 8"
                      : length +
                            "a J1939 message of more than 8 needs a transport protocol, which hil "
                            "does not implement");
  }
  message.is_fd = is_long || format == FrameFormat::fd;
  message.format_is_stated = is_long || format != FrameFormat::unstated;
  const auto& rate = note.bit_rate_switch ? note.bit_rate_switch : initial("CANFD_BRS");
  message.bit_rate_switch = message.is_fd && rate && switches_bit_rate(*rate);
}

void DbcParser::apply_long_names() {
  const auto rename = [&](std::string& name, const std::string& long_name, std::size_t position,
                          auto& names) {
    if (long_name.empty() || long_name == name) return;
    if (!is_identifier(long_name)) {
      return report(Severity::warning, position, "the long name of '" + name + "' is not an identifier");
    }
    if (!names.emplace(long_name, 0).second) {
      return report(Severity::warning, position,
                    "the long name of '" + name + "' is already in use: '" + long_name + "'");
    }
    name = long_name;
  };
  for (std::size_t index = 0; index < notes_.size(); ++index) {
    DbcMessage& message = result_.database.messages[index];
    MessageNote& note = notes_[index];
    rename(message.name, note.long_name, note.position, message_by_name_);
    for (const auto& [signal, long_name] : note.long_signal_names)
      rename(message.signals[signal].name, long_name, note.signals[signal].position, note.signal_by_name);
    const auto sender = long_node_names_.find(message.sender);
    if (sender != long_node_names_.end()) message.sender = sender->second;
  }
  for (std::string& node : result_.database.nodes) {
    const auto found = long_node_names_.find(node);
    if (found != long_node_names_.end()) node = found->second;
  }
}

}  // namespace hil::io::can
