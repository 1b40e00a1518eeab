#include "io/can/dbc_attributes.hpp"

#include <linux/can.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace hil::io::can {

namespace {

bool is_identifier(std::string_view name) {
  DbcScanner scanner(name);
  return !name.empty() && scanner.identifier() == name;
}

/// The value as a number, also if it is written as a string. Empty: it is not a finite number.
std::optional<double> number_of(const DbcAttributeValue& value) {
  if (value.number && std::isfinite(*value.number)) return value.number;
  if (value.number || value.text.empty()) return std::nullopt;
  double number = 0.0;
  const char* const end = value.text.data() + value.text.size();
  const auto [stop, fault] = std::from_chars(value.text.data(), end, number);
  if (fault != std::errc{} || stop != end || !std::isfinite(number)) return std::nullopt;
  return number;
}

/// Empty unless it is a number of milliseconds below 1e9.
std::optional<std::int64_t> cycle_time_of(const DbcAttributeValue& value) {
  const auto cycle_time_ms = number_of(value);
  if (!cycle_time_ms || !(*cycle_time_ms >= 0.0 && *cycle_time_ms < 1e9)) return std::nullopt;
  return std::llround(*cycle_time_ms);
}

}  // namespace

void DbcAttributes::set_default(const std::string& name, DbcAttributeValue value) {
  definitions_[name].initial = std::move(value);
}

void DbcAttributes::set_of_message(std::string_view name, std::uint32_t file_id,
                                   const DbcAttributeValue& value, std::size_t position, DbcDraft& draft,
                                   DbcProblems& problems) {
  constexpr std::string_view used[] = {"VFrameFormat", "CANFD_BRS", "SystemMessageLongSymbol",
                                       "GenMsgCycleTime"};
  if (std::ranges::find(used, name) == std::end(used)) return;
  DbcMessage* const message = draft.find_message(file_id, position, problems);
  if (message == nullptr) return;
  DbcMessageNote& note = draft.note_of(*message);
  if (name == "VFrameFormat") note.frame_format = value;
  if (name == "CANFD_BRS") note.bit_rate_switch = value;
  if (name == "SystemMessageLongSymbol") note.long_name = value.text;
  if (name != "GenMsgCycleTime") return;
  const auto cycle_time_ms = cycle_time_of(value);
  if (!cycle_time_ms) {
    return problems.report(DbcProblem::Severity::error, position,
                           "the GenMsgCycleTime of message '" + message->name +
                               "' is not a number of milliseconds from 0 to 1e9");
  }
  message->cycle_time_ms = *cycle_time_ms;
  note.has_cycle_time = true;
}

void DbcAttributes::set_of_signal(std::string_view name, std::uint32_t file_id, std::string_view signal,
                                  const DbcAttributeValue& value, std::size_t position, DbcDraft& draft,
                                  DbcProblems& problems) {
  const bool is_start = name == "GenSigStartValue";
  if (!is_start && name != "SystemSignalLongSymbol") return;
  DbcSignal* const found = draft.find_signal(file_id, signal, position, problems);
  if (found == nullptr) return;
  if (is_start) {
    found->start_raw = number_of(value);
  } else {
    DbcMessage& message = *draft.message_of_id(file_id);
    draft.note_of(message).long_signal_names.emplace_back(
        static_cast<std::size_t>(found - message.signals.data()), value.text);
  }
}

void DbcAttributes::set_of_node(std::string_view name, std::string_view node,
                                const DbcAttributeValue& value) {
  if (name == "SystemNodeLongSymbol" && is_identifier(value.text))
    long_node_names_.insert_or_assign(std::string(node), value.text);
}

/// The format that a value of VFrameFormat denotes. A number for which the definition has no word has
/// Vector's meaning.
DbcAttributes::FrameFormat DbcAttributes::format_of(const DbcAttributeValue& value) {
  const std::vector<std::string>& words = definitions_["VFrameFormat"].words;
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

bool DbcAttributes::switches_bit_rate(const DbcAttributeValue& value) {
  const std::vector<std::string>& words = definitions_["CANFD_BRS"].words;
  const auto number = number_of(value);
  if (value.number && *value.number >= 0.0 && *value.number < static_cast<double>(words.size()))
    return words[static_cast<std::size_t>(*value.number)] == "1";
  return number ? *number != 0.0 : value.text == "on" || value.text == "true";
}

void DbcAttributes::apply_to(DbcMessage& message, const DbcMessageNote& note, DbcProblems& problems) {
  const auto initial = [&](const char* attribute) -> const std::optional<DbcAttributeValue>& {
    return definitions_[attribute].initial;
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
    problems.make_unusable(message, note.position,
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

void DbcAttributes::apply_long_names(DbcDraft& draft, DbcProblems& problems) {
  const auto rename = [&](std::string& name, const std::string& long_name, std::size_t position,
                          auto& names) {
    if (long_name.empty() || long_name == name) return;
    if (!is_identifier(long_name)) {
      return problems.report(DbcProblem::Severity::warning, position,
                             "the long name of '" + name + "' is not an identifier");
    }
    if (!names.emplace(long_name, 0).second) {
      return problems.report(DbcProblem::Severity::warning, position,
                             "the long name of '" + name + "' is already in use: '" + long_name + "'");
    }
    name = long_name;
  };
  for (std::size_t index = 0; index < draft.notes.size(); ++index) {
    DbcMessage& message = draft.database.messages[index];
    DbcMessageNote& note = draft.notes[index];
    rename(message.name, note.long_name, note.position, draft.message_by_name);
    for (const auto& [signal, long_name] : note.long_signal_names)
      rename(message.signals[signal].name, long_name, note.signals[signal].position, note.signal_by_name);
    const auto sender = long_node_names_.find(message.sender);
    if (sender != long_node_names_.end()) message.sender = sender->second;
  }
  for (std::string& node : draft.database.nodes) {
    const auto found = long_node_names_.find(node);
    if (found != long_node_names_.end()) node = found->second;
  }
}

}  // namespace hil::io::can
