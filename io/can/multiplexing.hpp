#pragma once
// Which signals of a multiplexed message are present. Pure functions; the chains of switches have no cycle
// (parse_dbc).

#include <algorithm>
#include <cstdint>

#include "io/can/dbc.hpp"

namespace hil::io::can {

inline bool selected_by(const DbcSignal& signal, std::uint64_t switch_value) noexcept {
  return std::any_of(signal.multiplex_ranges.begin(), signal.multiplex_ranges.end(),
                     [switch_value](const MultiplexRange& range) {
                       return switch_value >= range.first && switch_value <= range.last;
                     });
}

/// False when a switch that both hang on has no value that selects both.
inline bool can_be_present_together(const DbcMessage& message, const DbcSignal& one, const DbcSignal& other) {
  const auto above = [&](const DbcSignal& signal) -> const DbcSignal* {
    return signal.multiplexer < 0 ? nullptr : &message.signals[static_cast<std::size_t>(signal.multiplexer)];
  };
  for (const DbcSignal* a = &one; a->multiplexer >= 0; a = above(*a)) {
    for (const DbcSignal* b = &other; b->multiplexer >= 0; b = above(*b)) {
      if (a->multiplexer != b->multiplexer) continue;
      const bool meet = std::any_of(
          a->multiplex_ranges.begin(), a->multiplex_ranges.end(), [&](const MultiplexRange& range_a) {
            return std::any_of(b->multiplex_ranges.begin(), b->multiplex_ranges.end(),
                               [&](const MultiplexRange& range_b) {
                                 return range_a.first <= range_b.last && range_b.first <= range_a.last;
                               });
          });
      if (!meet) return false;
    }
  }
  return true;
}

}  // namespace hil::io::can
