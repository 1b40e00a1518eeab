#pragma once
// Checks of messages that need the whole file: which multiplexer selects which signal, and which signals
// share bits.

#include <cstdint>

#include "io/can/dbc_draft.hpp"

namespace hil::io::can {

/// Sets the multiplexers of signals for which no SG_MUL_VAL_ names one. Marks the message as unusable where
/// that is ambiguous, or where multiplexers form a cycle.
void link_multiplexers(DbcMessage& message, const DbcMessageNote& note, DbcProblems& problems);

/// Sets DbcSignal::fits and reports overlapping signals. `steps` counts the comparisons over all messages of
/// a file, up to max_overlap_steps.
void find_overlaps(DbcMessage& message, const DbcMessageNote& note, std::uint64_t& steps,
                   DbcProblems& problems);

}  // namespace hil::io::can
