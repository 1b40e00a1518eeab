#pragma once
// Which signals of a message share bits in one frame. Pure functions; the chains of switches have no cycle
// (parse_dbc).

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "io/can/dbc.hpp"

namespace hil::io::can {

/// False when a switch that both depend on has no value that selects both. Adds its comparisons to `steps`.
bool can_be_present_together(const DbcMessage& message, const DbcSignal& one, const DbcSignal& other,
                             std::uint64_t& steps);

/// Indices of signals that can be present together and share a bit, the first index below the second. At most
/// `max_pairs`, in the order of the second, then of the first. Stops early where multiplexing makes it too long a
/// search; parse_dbc marks such a message as unusable.
std::vector<std::pair<std::size_t, std::size_t>> overlapping_pairs(const DbcMessage& message,
                                                                   std::size_t max_pairs);

}  // namespace hil::io::can
