#include "runtime/report/trace_json.hpp"

#include <cstdio>
#include <cstdlib>
#include <ostream>
#include <string_view>

#include "runtime/report/json_layout.hpp"

namespace hil::report {
namespace {

void require_track(const TraceRecord& trace, std::uint32_t track) {
  if (track < trace.tracks.size()) return;
  std::fprintf(stderr, "runtime/report/trace_json: track %u of %zu\n", track, trace.tracks.size());
  std::abort();
}

/// The unit of the format is microseconds; the decimals are nanoseconds, exact.
std::string microseconds(std::int64_t ns) {
  const auto bits = static_cast<std::uint64_t>(ns);
  const std::uint64_t size = ns < 0 ? ~bits + 1 : bits;
  std::string text(ns < 0 ? "-" : "");
  text += std::to_string(size / 1'000);
  text += '.';
  text += std::to_string(1'000 + size % 1'000).substr(1);
  return text;
}

/// Events one per line, commas between them.
class EventList {
 public:
  explicit EventList(std::ostream& out) : out_(out) {}
  void add(const std::string& members) {
    out_ << (first_ ? "\n{" : ",\n{") << members << '}';
    first_ = false;
  }

 private:
  std::ostream& out_;
  bool first_ = true;
};

/// Thread ids start at 1; 0 is the process.
std::string where(std::uint32_t track) {
  return R"("pid":1,"tid":)" + std::to_string(track + 1);
}

void name_rows(EventList& events, const TraceRecord& trace) {
  events.add(R"("ph":"M","pid":1,"name":"process_name","args":{"name":)" + json_quoted(trace.process_name) +
             '}');
  for (std::uint32_t track = 0; track < trace.tracks.size(); ++track) {
    events.add(R"("ph":"M",)" + where(track) + R"(,"name":"thread_name","args":{"name":)" +
               json_quoted(trace.tracks[track].name) + '}');
    events.add(R"("ph":"M",)" + where(track) + R"(,"name":"thread_sort_index","args":{"sort_index":)" +
               std::to_string(track) + '}');
  }
}

}  // namespace

void write_trace_json(std::ostream& out, const TraceRecord& trace) {
  out << R"({"displayTimeUnit":"ns","traceEvents":[)";
  EventList events(out);
  name_rows(events, trace);
  for (const TraceSpan& span : trace.spans) {
    require_track(trace, span.track);
    const std::string& name = span.name.empty() ? trace.tracks[span.track].name : span.name;
    events.add(R"("ph":"X",)" + where(span.track) + R"(,"ts":)" + microseconds(span.start_ns) + R"(,"dur":)" +
               microseconds(span.duration_ns) + R"(,"name":)" + json_quoted(name) + R"(,"args":{"tick":)" +
               std::to_string(span.tick) + '}');
  }
  for (const TraceInstant& instant : trace.instants) {
    const bool global = instant.track == TraceInstant::whole_run;
    if (!global) require_track(trace, instant.track);
    events.add(R"("ph":"i","s":)" +
               std::string(global ? R"("g","pid":1,"tid":0)" : R"("t",)" + where(instant.track)) +
               R"(,"ts":)" + microseconds(instant.time_ns) + R"(,"name":)" + json_quoted(instant.text));
  }
  out << "\n]}\n";
}

}  // namespace hil::report
