#include <algorithm>

#include <hil/quantity.hpp>

#include "runtime/config/run_end.hpp"
#include "runtime/config/section_readers.hpp"

namespace hil::config {
namespace {

std::optional<std::int64_t> optional_time(const Value& plot, const char* key) {
  return plot.has(key) ? std::optional(plot[key].duration_ns()) : std::nullopt;
}

void check_time_range(const Value& value, const PlotSection& plot, std::int64_t duration_ns,
                      std::int64_t period_ns, Diagnostics& diagnostics) {
  const auto refuse = [&](const char* key, std::int64_t time_ns, const std::string& reason) {
    diagnostics.add(value[key].place(), in_quotes(key) + ": " + format_duration(time_ns) + reason);
  };
  if (duration_ns > 0 && plot.until_ns && *plot.until_ns > duration_ns)
    refuse("until", *plot.until_ns,
           " is after the end of the run, which takes " + format_duration(duration_ns) +
               "; leave it out for a plot to the end");
  if (period_ns > 0 && plot.until_ns) {
    const std::int64_t first_tick_ns = (plot.from_ns.value_or(0) + period_ns - 1) / period_ns * period_ns;
    if (plot.from_ns && *plot.from_ns < *plot.until_ns && first_tick_ns > *plot.until_ns)
      refuse("until", *plot.until_ns,
             " is before the first tick from 'from' on, " + format_duration(first_tick_ns));
  }
  if (!plot.from_ns) return;
  if (plot.until_ns && *plot.from_ns >= *plot.until_ns)
    refuse("from", *plot.from_ns, " is not before 'until', " + format_duration(*plot.until_ns));
  else if (const std::string reason = reason_without_tick(*plot.from_ns, period_ns, duration_ns);
           !reason.empty())
    refuse("from", *plot.from_ns, reason);
}

}  // namespace

void read_plots(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const list = part_of(root, "plots");
  if (list == nullptr) return;
  for (const Value& value : list->items()) {
    if (!is_whole(value)) continue;
    PlotSection plot{.title = value["title"].text(),
                     .signals = {},
                     .from_ns = optional_time(value, "from"),
                     .until_ns = optional_time(value, "until")};
    for (const Value& signal : value["signals"].items()) {
      if (std::ranges::find(plot.signals, signal.text(), &Word::text) != plot.signals.end())
        reading.diagnostics.add(signal.place(), in_quotes(signal.text()) + " is in the plot twice");
      plot.signals.push_back(word_of(signal));
    }
    check_time_range(value, plot, scenario.duration_ns, scenario.base_period_ns, reading.diagnostics);
    scenario.plots.push_back(std::move(plot));
  }
}

}  // namespace hil::config
