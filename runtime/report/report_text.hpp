#pragma once
// What a console shows: one live line while a run goes on, a few lines when it has ended. Pure functions;
// ASCII apart from the user's own words, no control characters, no colours.

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

/// No line break, at most `columns` wide: what does not fit is left out from the end, whole words at a time.
std::string live_line(const LiveStatus& status, std::size_t columns);

/// Verdict, reason, what else failed outside the run, losses, expectations that did not hold, misses by task
/// and cause, releases skipped, ticks given up, what was degraded, where the report lies. Each line ends with
/// a newline. An empty place: there is no report.
std::string report_text(const RunRecord& record, const std::string& report_place);

/// How many ticks were given up, of how many, and why; empty when none was. Typographic.
std::string ticks_given_up(const RunRecord& record);

/// How many of the task's releases were skipped or aborted, of how many; empty when none was. Typographic.
std::string releases_lost(const Task& task);

/// What was lost, since when, for how long and why. Typographic.
std::string sentence_of(const Loss& loss);

/// "Passed", "Failed", "Timing broken", ...
const char* headline(Verdict verdict) noexcept;

/// The record's reason, or a sentence that the verdict alone supports when it has none.
std::string reason_sentence(const RunRecord& record);

}  // namespace hil::report
