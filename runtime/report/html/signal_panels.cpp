#include "runtime/report/html/signal_panels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

constexpr std::size_t panel_colours = 8;
constexpr double largest_drawn = 1e100;
/// A limit farther from the values than so many times their range is not drawn.
constexpr double far_limit = 10.0;

bool is_drawn(double value) {
  return std::abs(value) <= largest_drawn;
}

/// Of the values that can be drawn. Empty: there is none.
std::optional<Interval> values_of(const SignalSeries& series) {
  Interval values{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const SignalPoint& point : series.points) {
    if (!is_drawn(point.min) || !is_drawn(point.max)) continue;
    const double tolerance = std::isfinite(series.tolerance) ? series.tolerance : 0.0;
    values.low = std::min(values.low, point.min - tolerance);
    values.high = std::max(values.high, point.max + tolerance);
  }
  if (values.low > values.high) return std::nullopt;
  return values;
}

bool has_whole_numbers(const SignalSeries& series) {
  return std::ranges::all_of(series.points, [](const SignalPoint& point) {
    return std::isnan(point.min) || (point.min == std::rint(point.min) && point.max == std::rint(point.max));
  });
}

bool has_discrete_values(const SignalSeries& series) {
  return !series.named_values.empty() || (series.unit.empty() && has_whole_numbers(series));
}

/// The entry of the signal that a faulted series or a reference belongs to.
const PanelSeries* entry_of_signal(const SignalSeries& series, const Panel& panel) {
  const auto found = std::ranges::find_if(panel.series, [&](const PanelSeries& entry) {
    const bool has_name = series.kind == SeriesKind::reference
                              ? series.name == entry.series->name
                              : series.name.starts_with(entry.series->name + '.');
    return entry.series->kind == SeriesKind::signal && has_name;
  });
  return found == panel.series.end() ? nullptr : &*found;
}

void place(const SignalSeries& series, std::vector<Panel>& panels) {
  if (series.kind != SeriesKind::signal) {
    for (Panel& panel : panels) {
      const PanelSeries* const signal = entry_of_signal(series, panel);
      if (signal == nullptr) continue;
      panel.series.push_back({&series, signal->colour});
      return;
    }
  }
  const bool is_discrete = has_discrete_values(series);
  Panel* panel = nullptr;
  if (!is_discrete && !series.unit.empty()) {
    const auto same_unit = std::ranges::find_if(panels, [&](const Panel& other) {
      return !other.is_discrete && other.series.front().series->unit == series.unit;
    });
    if (same_unit != panels.end()) panel = &*same_unit;
  }
  if (panel == nullptr) {
    panel = &panels.emplace_back();
    panel->is_discrete = is_discrete;
  }
  panel->series.push_back({&series, panel->series.size() % panel_colours});
}

Interval with_margin(Interval range, double share) {
  const double length = range.high - range.low;
  const double margin = length > 0.0 ? share * length : std::max(0.1 * std::abs(range.low), 0.5);
  return {range.low - margin, range.high + margin};
}

std::vector<PanelTick> number_ticks(Interval range, int max_count) {
  const double step = linear_step(range.high - range.low, max_count);
  const bool is_plain = step >= 1e-4 && std::max(std::abs(range.low), std::abs(range.high)) < 1e6;
  std::vector<PanelTick> ticks;
  for (const double value : linear_ticks(range, max_count))
    ticks.push_back({value, is_plain ? decimal(value, decimals_of_step(step)) : quantity_text(value, "")});
  return ticks;
}

void add_scale(Panel& panel) {
  std::optional<Interval> values;
  for (const PanelSeries& entry : panel.series) {
    const auto of_series = values_of(*entry.series);
    if (!of_series) continue;
    if (!values) values = *of_series;
    values->low = std::min(values->low, of_series->low);
    values->high = std::max(values->high, of_series->high);
  }
  panel.is_known = values.has_value();
  Interval range = values.value_or(Interval{0.0, 1.0});
  const std::vector<NamedValue>& names = panel.series.front().series->named_values;
  const bool is_truth = panel.is_discrete && names.empty() && range.low >= 0.0 && range.high <= 1.0;
  if (is_truth) {
    panel.range = {-0.15, 1.15};
    panel.ticks = {{0.0, "0"}, {1.0, "1"}};
    panel.height_px = 30.0;
    return;
  }
  const double length = range.high - range.low;
  const Interval reach{range.low - far_limit * length, range.high + far_limit * length};
  for (const double limit : panel.limits) {
    if (length > 0.0 && (limit < reach.low || limit > reach.high)) continue;
    range.low = std::min(range.low, limit);
    range.high = std::max(range.high, limit);
  }
  panel.range = with_margin(range, 0.06);
  constexpr std::size_t max_named = 8;
  for (const NamedValue& named : names) {
    if (named.value >= range.low && named.value <= range.high)
      panel.ticks.push_back({named.value, named.name});
  }
  if (panel.ticks.empty() || panel.ticks.size() > max_named) panel.ticks = number_ticks(panel.range, 4);
  panel.height_px = !names.empty()      ? std::max(44.0, 20.0 * static_cast<double>(panel.ticks.size()))
                    : panel.is_discrete ? 80.0
                                        : 130.0;
}

}  // namespace

std::vector<Panel> panels_of(const SignalPlots& all, const SignalPlot& plot) {
  std::vector<Panel> panels;
  for (const bool is_signal : {true, false}) {
    for (const std::uint32_t index : plot.series) {
      if (index < all.series.size() && (all.series[index].kind == SeriesKind::signal) == is_signal)
        place(all.series[index], panels);
    }
  }
  for (const SignalLimit& limit : plot.limits) {
    if (limit.series >= all.series.size() || !is_drawn(limit.value)) continue;
    for (Panel& panel : panels) {
      const bool is_here = std::ranges::any_of(
          panel.series, [&](const PanelSeries& entry) { return entry.series == &all.series[limit.series]; });
      if (is_here && std::ranges::find(panel.limits, limit.value) == panel.limits.end())
        panel.limits.push_back(limit.value);
    }
  }
  for (Panel& panel : panels)
    add_scale(panel);
  return panels;
}

}  // namespace hil::report
