#pragma once
// Reads a log in the format of candump -l (io/can/candump_log.hpp), whose frames a bus sends as those of
// other stations.
//
// Error frames are not played, and neither are data frames of messages that the run itself sends.
//
// Threads: the one that wires the scenario.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "io/can/log_playback.hpp"
#include "runtime/buses/can/can_section.hpp"
#include "runtime/config/diagnostics.hpp"

namespace hil::buses::can {

/// Larger logs are refused.
inline constexpr std::size_t max_log_bytes = std::size_t{64} << 20;
inline constexpr std::size_t max_played_frames = 1'000'000;
/// A frame may be this much earlier than an earlier line of its interface, and is then played at that time.
/// Clocks of one machine differ by less.
inline constexpr std::int64_t max_log_disorder_ns = 100'000'000;

/// `sent_ids`: of the messages that the run sends. Empty with mistakes at the lines of the log, or where the
/// scenario names it. Warns of frames that are not played.
std::optional<io::can::PlaybackConfig> read_played_log(const PlayedLog& section,
                                                       const std::vector<canid_t>& sent_ids,
                                                       config::Diagnostics& diagnostics);

}  // namespace hil::buses::can
