#pragma once
// Which signals of a message share bits in one frame. Pure functions of messages whose multiplexers have no
// cycle, as parse_dbc gives them.

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "io/can/dbc.hpp"

namespace hil::io::can {

/// The limit on comparisons of multiplexer values: of one file for parse_dbc, of one message for
/// overlapping_pairs. Databases of whole cars need a few thousand.
inline constexpr std::uint64_t max_overlap_steps = 20'000'000;

/// False when a multiplexer that both depend on has no value that selects both. Adds its comparisons to
/// `steps`.
bool can_be_present_together(const DbcMessage& message, const DbcSignal& one, const DbcSignal& other,
                             std::uint64_t& steps);

/// Indices of signals that can be present together and share a bit, the first index below the second. At most
/// `max_pairs`, in the order of the second, then of the first. Stops after max_overlap_steps; parse_dbc marks
/// such a message as unusable.
std::vector<std::pair<std::size_t, std::size_t>> overlapping_pairs(const DbcMessage& message,
                                                                   std::size_t max_pairs);

}  // namespace hil::io::can
