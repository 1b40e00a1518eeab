#pragma once
// trace.json: the run as a timeline in the Chrome trace event format, which Perfetto (ui.perfetto.dev) and
// chrome://tracing open. It is made from the recorder's spans, not from the RunRecord, and is written once.

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace hil::report {

/// One row of the timeline: the base tick, a task, an I/O thread.
struct TraceTrack {
  std::string name;
};

/// `track` counts into TraceRecord::tracks (misuse otherwise: asserts). Empty `name`: the track's name.
struct TraceSpan {
  std::uint32_t track = 0;
  std::uint64_t tick = 0;
  std::int64_t start_ns = 0;
  std::int64_t duration_ns = 0;
  std::string name;
};

/// A point in time: a deadline miss on its task's track, or an event of the whole run (no track).
struct TraceInstant {
  static constexpr std::uint32_t whole_run = UINT32_MAX;
  std::uint32_t track = whole_run;
  std::int64_t time_ns = 0;
  std::string text;
};

struct TraceRecord {
  std::string process_name;
  std::vector<TraceTrack> tracks;
  std::vector<TraceSpan> spans;
  std::vector<TraceInstant> instants;
};

/// Streams, so the document is never whole in memory. The caller looks at the stream's state.
void write_trace_json(std::ostream& out, const TraceRecord& trace);

}  // namespace hil::report
