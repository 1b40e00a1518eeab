#pragma once
// trace.json: the run as a timeline in the Chrome trace event format, which Perfetto (ui.perfetto.dev) and
// chrome://tracing open. It is made of the recorder's spans, not of the RunRecord, and written once.

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace hil::report {

/// One row of the timeline: the base tick, a task, an I/O thread.
struct TraceTrack {
  std::string name;
};

/// `track` is an index into TraceRecord::tracks; else misuse (asserts). Empty `name`: the name of the track.
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

/// Streams, so that the document is never completely in memory. The caller checks the state of the stream.
void write_trace_json(std::ostream& out, const TraceRecord& trace);

}  // namespace hil::report
