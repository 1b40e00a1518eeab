#pragma once
// What the report shows of a CAN bus.
//
// Threads: plain data, filled after the device is stopped.

#include <cstdint>
#include <string>
#include <vector>

#include <hil/section.hpp>

#include "io/can/can_device.hpp"
#include "runtime/contribution/bus_record.hpp"

namespace hil::buses::can {

/// Received frames that were longer than their message (the rest is padding), or shorter (only signals that
/// the frame contains completely were updated).
struct FrameLengths {
  std::string message;
  std::uint64_t longer = 0;
  std::uint64_t shorter = 0;
};

using io::can::RejectionCounts;

/// The log contains what was on the bus: rx + tx + played + errors - fault_dropped_tx - log_dropped frames.
struct CanRecord {
  std::string bus;
  std::string driver;
  std::uint64_t rx = 0;
  std::uint64_t tx = 0;         ///< sent, fault_dropped_tx included
  std::uint64_t dropped = 0;    ///< lost since a queue was full
  std::uint64_t errors = 0;     ///< error frames
  std::uint64_t no_buffer = 0;  ///< sends with a full queue; each was retried once
  std::uint64_t bad_checksum = 0;
  std::uint64_t bad_counter = 0;
  std::uint64_t unknown_id = 0;
  double bus_load_mean = contribution::not_known;  ///< of the whole tenths of a second in the run
  double bus_load_peak = contribution::not_known;  ///< the highest of one tenth of a second
  std::uint64_t send_errors = 0;                   ///< sends that failed, without those of a log
  std::string send_fault{};            ///< why the first frame that fails the run could not be sent
  std::uint64_t wrong_kind = 0;        ///< rejected frames: remote requests, or of another format
  std::uint64_t saturated = 0;         ///< output values beyond their signal's range
  std::uint64_t refused_values = 0;    ///< output values that were not a number
  std::uint64_t dropped_releases = 0;  ///< ticks whose outputs were not sent
  std::uint64_t log_dropped = 0;       ///< frames missing in the log
  std::uint64_t lost_arrivals = 0;     ///< received frames that expectations lack
  std::uint64_t fault_dropped_tx = 0;  ///< sent frames that fault injection dropped: never on the bus
  std::uint64_t fault_dropped_rx = 0;  ///< frames of other stations that fault injection dropped
  std::uint64_t fault_corrupted = 0;
  std::uint64_t fault_delayed = 0;
  std::uint64_t played = 0;  ///< frames of a log that were sent; neither in rx nor in tx
  /// Frames of the log with an identifier that the database does not have, also those that a fault drops,
  /// which `played` does not count.
  std::uint64_t play_unknown_id = 0;
  std::uint64_t play_unsent = 0;                 ///< frames of a log that could not be sent
  std::vector<FrameLengths> other_lengths = {};  ///< of the messages that had such frames
  std::vector<RejectionCounts> rejected = {};    ///< of the messages that had rejected frames
};

CanRecord record_of(const io::can::CanDevice& device);

/// The columns of the table on the page.
std::vector<contribution::BusColumn> can_columns();

/// Faults: output values and frames that were changed, not sent or not logged. Remarks: further counters that
/// have no column, injected faults included.
contribution::BusRecord to_record(const CanRecord& bus);

}  // namespace hil::buses::can
