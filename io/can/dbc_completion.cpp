#include "io/can/dbc_completion.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "io/can/signal_codec.hpp"
#include "io/can/signal_overlap.hpp"

namespace hil::io::can {

namespace {

constexpr int max_multiplexer_depth = 16;

/// A cycle of multiplexers could never be resolved.
void check_multiplexer_chains(DbcMessage& message, const DbcMessageNote& note, DbcProblems& problems) {
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    int at = message.signals[index].multiplexer;
    for (int depth = 0; at >= 0 && depth < max_multiplexer_depth; ++depth)
      at = message.signals[static_cast<std::size_t>(at)].multiplexer;
    if (at < 0) continue;
    problems.make_unusable(
        message, note.signals[index].position,
        "signal '" + message.signals[index].name +
            "' selects itself through its multiplexers, or is nested deeper than 16 of them");
    message.signals[index].multiplexer = -1;
    message.signals[index].multiplex_ranges.clear();
  }
}

}  // namespace

void link_multiplexers(DbcMessage& message, const DbcMessageNote& note, DbcProblems& problems) {
  int only_multiplexer = -1;
  int multiplexers = 0;
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    if (!message.signals[index].is_multiplexer) continue;
    only_multiplexer = static_cast<int>(index);
    ++multiplexers;
  }
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    DbcSignal& signal = message.signals[index];
    if (!note.signals[index].multiplexed || signal.multiplexer >= 0) continue;
    const bool has_value = !signal.multiplex_ranges.empty();
    if (!has_value && signal.is_multiplexer) continue;  // a bare 'm' on the outermost multiplexer
    if (has_value && multiplexers == 1 && only_multiplexer != static_cast<int>(index)) {
      signal.multiplexer = only_multiplexer;
      continue;
    }
    problems.make_unusable(
        message, note.signals[index].position,
        "signal '" + signal.name + "' is multiplexed, but " +
            (!has_value          ? "its mark 'm' has no number, and there is no SG_MUL_VAL_ for it"
             : multiplexers == 0 ? "the message has no multiplexer"
                                 : "the message has several multiplexers and no SG_MUL_VAL_ for it"));
    signal.multiplex_ranges.clear();
  }
  check_multiplexer_chains(message, note, problems);
}

void find_overlaps(DbcMessage& message, const DbcMessageNote& note, std::uint64_t& steps,
                   DbcProblems& problems) {
  PayloadBits used_by_any;
  std::vector<PayloadBits> bits(message.signals.size());
  for (std::size_t index = 0; index < message.signals.size(); ++index) {
    DbcSignal& signal = message.signals[index];
    signal.fits = bits_of(signal, bits[index]) && (bits[index] >> (8U * message.length_bytes)).none();
    if (!signal.fits) {
      problems.make_unusable(message, note.signals[index].position,
                             "signal '" + signal.name + "' reaches beyond its " +
                                 std::to_string(message.length_bytes) + " bytes");
      bits[index].reset();
      continue;
    }
    for (std::size_t earlier = 0; (used_by_any & bits[index]).any() && earlier < index; ++earlier) {
      if ((bits[earlier] & bits[index]).none()) continue;
      const DbcSignal& other = message.signals[earlier];
      if (steps > max_overlap_steps) {
        problems.make_unusable(message, note.signals[index].position,
                               "its multiplexing has too many ranges to be checked for overlaps");
        break;
      }
      if (!can_be_present_together(message, signal, other, steps)) continue;
      problems.report(DbcProblem::Severity::unusable, note.signals[index].position,
                      "signal '" + signal.name + "' overlaps signal '" + other.name + "' of message '" +
                          message.name + "'");
      break;
    }
    used_by_any |= bits[index];
  }
}

}  // namespace hil::io::can
