#pragma once
// Finds signals of a message that share bits in one frame. Pure functions. The multiplexers of the message
// must have no cycle, which parse_dbc guarantees.

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "io/can/dbc.hpp"

namespace hil::io::can {

/// The limit on comparisons of multiplexer values, per file for parse_dbc and per message for
/// overlapping_pairs; about a thousand times what large files need.
inline constexpr std::uint64_t max_overlap_steps = 20'000'000;

/// False when a multiplexer that both depend on has no value that selects both. Adds its comparisons to
/// `steps`.
bool can_be_present_together(const DbcMessage& message, const DbcSignal& one, const DbcSignal& other,
                             std::uint64_t& steps);

/// Pairs of signal indices, lower first, that can be present together and share a bit. At most `max_pairs`,
/// ordered by the second, then by the first index. Stops after max_overlap_steps; parse_dbc marks such a
/// message as unusable.
std::vector<std::pair<std::size_t, std::size_t>> overlapping_pairs(const DbcMessage& message,
                                                                   std::size_t max_pairs);

}  // namespace hil::io::can
