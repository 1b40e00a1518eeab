#include "runtime/report/html/signal_lanes.hpp"

#include <algorithm>

namespace hil::report {
namespace {

bool was_active_in(const SignalPlot& plot, const Injection& injection) {
  return std::ranges::any_of(
      injection.spans, [&](const ActiveSpan& span) { return is_in_plot(plot, span.begin_ns, span.end_ns); });
}

/// A log that a bus plays has one span.
bool is_cut(const Injection& injection) {
  return injection.spans.size() > 1 && injection.begins > injection.spans.size();
}

Lane& lane_for(const Injection& injection, bool is_fault, std::vector<Lane>& lanes) {
  const std::string& table = injection.test_table;
  if (table.empty())
    return lanes.emplace_back(Lane{
        .kind = is_fault ? "fault" : "stimulus", .name = injection.name, .spans = {}, .name_suffix = {}});
  const auto shared = std::ranges::find_if(
      lanes, [&](const Lane& lane) { return lane.kind == "test table" && lane.name == table; });
  if (shared != lanes.end()) return *shared;
  return lanes.emplace_back(Lane{.kind = "test table", .name = table, .spans = {}, .name_suffix = {}});
}

}  // namespace

Lanes lanes_of(const RunRecord& record, const SignalPlot& plot) {
  Lanes lanes;
  for (const bool is_fault : {true, false}) {
    for (const Injection& injection : is_fault ? record.faults : record.stimuli) {
      if (!was_active_in(plot, injection)) continue;
      Lane& lane = lane_for(injection, is_fault, lanes.shown);
      ++lane.injections;
      for (const ActiveSpan& span : injection.spans)
        lane.spans.push_back({span, is_fault});
      if (is_cut(injection))
        lane.name_suffix = ", the first " + std::to_string(injection.spans.size()) +
                           (injection.test_table.empty() ? "" : " of each");
    }
  }
  for (Lane& lane : lanes.shown)
    std::ranges::stable_sort(lane.spans, {}, &LaneSpan::is_fault);
  while (lanes.shown.size() > max_lanes) {
    lanes.left_out += lanes.shown.back().injections;
    lanes.shown.pop_back();
  }
  return lanes;
}

}  // namespace hil::report
