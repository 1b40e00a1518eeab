#pragma once
// The texts for a console: a live line during a run, and a few lines after it. Pure functions; ASCII apart
// from names of the user, no control characters, no colours.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/report/run_record.hpp"

namespace hil::report {

struct LiveBus {
  std::string name;
  double load = not_known;  ///< fraction of the bit rate
};

struct LiveStatus {
  std::int64_t run_time_ns = 0;
  std::int64_t duration_ns = 0;  ///< 0: until stopped
  double tick_rate_hz = 0.0;     ///< ticks per second of wall time since the last line
  std::uint64_t misses = 0;
  std::optional<std::int64_t> min_slack_ns;  ///< since the last line; empty: nothing ran
  std::vector<LiveBus> buses;
};

/// One line of at most `columns` columns, without its last fields if they do not fit.
std::string live_line(const LiveStatus& status, std::size_t columns);

/// Verdict, reason, further failures, losses, expectations that were not held, misses by task and cause,
/// skipped releases and ticks, what was degraded, and the place of the report (empty: there is none). Each
/// line ends with a newline.
std::string report_text(const RunRecord& record, const std::string& report_place);

/// The number of skipped ticks, with the reason; empty: none was skipped. Typographic (quantities.hpp).
std::string skipped_ticks_sentence(const RunRecord& record);
/// How many events are not listed; empty: all are. Typographic.
std::string unlisted_events_sentence(const RunRecord& record);

/// What the recording lacks, and why, in sentences; empty: nothing.
std::vector<std::string> lacks_of(const Recording& recording);

/// The file, its size and the number of its messages, with what it lacks. Typographic.
std::string recording_text(const Recording& recording);

/// The number of skipped and aborted releases of the task; empty: none. Typographic.
std::string lost_releases_sentence(const Task& task);
/// "task traffic: 3 of 1,000 runs had a hard transaction after its deadline, at most 0.4 ms late, in tick
/// 512: waited for other transactions". Empty: none had one.
std::string hard_misses_sentence(const Task& task);

/// Stimuli and faults that never began or took no effect, a sentence each: the run does not check what they
/// are for. Typographic.
std::vector<std::string> sentences_of_unchecked_injections(const RunRecord& record);

/// What was lost, with begin, duration and cause. Typographic.
std::string sentence_of(const Loss& loss);

/// "Passed", "Failed", "Timing broken", ...
const char* headline(Verdict verdict) noexcept;

/// The reason of the record, or a sentence on the verdict when it has none.
std::string reason_sentence(const RunRecord& record);
/// "11 of 14 held": of the expectations.
std::string held_sentence(const RunRecord& record);

}  // namespace hil::report
