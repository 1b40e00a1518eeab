#pragma once
// Reads a log in the format of candump -l (io/can/candump_line.hpp), whose frames a bus sends as those of
// other stations.
//
// Error frames are not played, and neither are data frames of messages that the run itself sends. Frames with
// an identifier that the database of the bus does not have are played, unless there are no others.
//
// Threads: the one that wires the scenario.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_set>

#include <hil/diagnostics.hpp>

#include "io/can/log_playback.hpp"
#include "runtime/buses/can/can_section.hpp"

namespace hil::buses::can {

/// Larger logs are refused.
inline constexpr std::size_t max_log_bytes = std::size_t{64} << 20;
inline constexpr std::size_t max_played_frames = 1'000'000;
/// A frame may be this much earlier than an earlier line of its interface, and is then played at that time.
/// Clocks of one machine differ by less.
inline constexpr std::int64_t max_log_disorder_ns = 100'000'000;

/// Of messages, with CAN_EFF_FLAG for an extended one.
struct BusIdentifiers {
  std::unordered_set<canid_t> sent;   ///< by the run
  std::unordered_set<canid_t> known;  ///< to the database
};

/// Empty with mistakes at the lines of the log, or where the scenario names it. Warns of frames that are not
/// played, and of unknown ones.
std::optional<io::can::PlaybackConfig> read_played_log(const PlayedLog& section, const BusIdentifiers& ids,
                                                       config::Diagnostics& diagnostics);

}  // namespace hil::buses::can
