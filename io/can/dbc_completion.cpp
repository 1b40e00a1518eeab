// What the DBC parser does when the whole text is read: defaults, multiplexers, overlaps.

#include <algorithm>

#include "io/can/dbc_parser.hpp"
#include "io/can/multiplexing.hpp"
#include "io/can/signal_codec.hpp"

namespace hil::io::can {

void DbcParser::complete_messages() {
  std::sort(has_cycle_time_.begin(), has_cycle_time_.end());
  for (const auto& [file_id, index] : message_by_id_) {
    if (!std::binary_search(has_cycle_time_.begin(), has_cycle_time_.end(), file_id)) {
      result_.database.messages[index].cycle_time_ms = default_cycle_time_ms_;
    }
  }
  for (std::size_t index = 0; index < result_.database.messages.size(); ++index) {
    link_multiplexers(result_.database.messages[index], notes_[index]);
    find_overlaps(result_.database.messages[index], notes_[index]);
  }
}

void DbcParser::link_multiplexers(DbcMessage& message, const MessageNote& note) {
  int only_switch = -1;
  int switches = 0;
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    if (!message.signals[index].is_multiplexer) continue;
    only_switch = static_cast<int>(index);
    ++switches;
  }
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    DbcSignal& signal = message.signals[index];
    if (!note.signals[index].multiplexed || signal.multiplexer >= 0) continue;
    if (switches == 1 && only_switch != static_cast<int>(index)) {
      signal.multiplexer = only_switch;
      continue;
    }
    report(
        DbcProblem::Severity::error, note.signals[index].position,
        "signal '" + signal.name + "' is multiplexed, but message '" + message.name + "' has " +
            (switches == 0 ? "no multiplexer" : "several multiplexers and no SG_MUL_VAL_ for this signal"));
    signal.multiplex_ranges.clear();
  }
  if (!note.has_extended_ranges) return;
  // A chain of switches that closes on itself would never be decided.
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    int at = static_cast<int>(index);
    for (std::size_t step = 0; at >= 0 && step <= message.signals.size(); ++step) {
      at = message.signals[static_cast<std::size_t>(at)].multiplexer;
    }
    if (at < 0) continue;
    report(DbcProblem::Severity::error, note.signals[index].position,
           "signal '" + message.signals[index].name + "' selects itself through its multiplexers");
    message.signals[index].multiplexer = -1;
  }
}

void DbcParser::find_overlaps(DbcMessage& message, const MessageNote& note) {
  PayloadBits used_by_any;
  std::vector<PayloadBits> bits(message.signals.size());
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    DbcSignal& signal = message.signals[index];
    signal.fits = bits_of(signal, bits[index]) && (bits[index] >> (8U * message.length_bytes)).none();
    if (!signal.fits) {
      report(DbcProblem::Severity::warning, note.signals[index].position,
             "signal '" + signal.name + "' reaches beyond the " + std::to_string(message.length_bytes) +
                 " bytes of message '" + message.name + "'");
      bits[index].reset();
      continue;
    }
    for (std::size_t earlier = 0; (used_by_any & bits[index]).any() && earlier < index; ++earlier) {
      const DbcSignal& other = message.signals[earlier];
      if ((bits[earlier] & bits[index]).none() || !can_be_present_together(message, signal, other)) continue;
      signal.overlaps = true;
      report(DbcProblem::Severity::warning, note.signals[index].position,
             "signal '" + signal.name + "' overlaps signal '" + other.name + "' of message '" + message.name +
                 "'");
      break;
    }
    used_by_any |= bits[index];
  }
}

}  // namespace hil::io::can
