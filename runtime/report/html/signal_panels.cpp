#include "runtime/report/html/signal_panels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "runtime/report/quantities.hpp"
#include "runtime/report/text_safety.hpp"

namespace hil::report {
namespace {

constexpr std::size_t panel_colours = 8;
constexpr double largest_drawn = 1e100;
/// A limit farther from the values than so many times their range is not drawn.
constexpr double far_limit = 10.0;

bool is_drawn(double value) {
  return std::abs(value) <= largest_drawn;
}

/// A bucket has a value that can not be drawn.
bool has_value_beyond(const SignalSeries& series) {
  return std::ranges::any_of(series.points, [](const SignalPoint& point) {
    return std::abs(point.min) > largest_drawn || std::abs(point.max) > largest_drawn;
  });
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

/// Whether the labels differ and fit beside the axis.
bool are_useful(const std::vector<PanelTick>& ticks) {
  constexpr std::size_t max_columns = 9;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (columns_of(ticks[i].label) > max_columns) return false;
    if (i > 0 && ticks[i].label == ticks[i - 1].label) return false;
  }
  return true;
}

/// With as many digits as tell multiples of the step apart.
std::string with_digits_of_step(double value, double step) {
  const double digits = value == 0.0 ? 1.0 : std::ceil(std::log10(std::abs(value) / step)) + 1.0;
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", static_cast<int>(std::clamp(digits, 1.0, 17.0)), value);
  return text;
}

/// The labels of values that are close to each other, compared with their distance from 0, are distances from
/// one of them, which a note names.
void add_number_ticks(Panel& panel, int max_count) {
  const Interval range = panel.range;
  const double step = linear_step(range.high - range.low, max_count);
  const bool is_plain = step >= 1e-4 && std::max(std::abs(range.low), std::abs(range.high)) < 1e6;
  const std::vector<double> values = linear_ticks(range, max_count);
  panel.ticks.clear();
  for (const double value : values)
    panel.ticks.push_back(
        {value, is_plain ? decimal(value, decimals_of_step(step)) : quantity_text(value, "")});
  if (are_useful(panel.ticks)) return;
  const std::size_t base_index = values.size() / 2;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string distance =
        quantity_text((static_cast<double>(i) - static_cast<double>(base_index)) * step, "");
    panel.ticks[i].label = i > base_index ? '+' + distance : distance;
  }
  const std::string& unit = panel.series.front().series->unit;
  panel.notes.push_back("labels are distances from " + with_digits_of_step(values[base_index], step) +
                        (unit.empty() ? "" : ' ' + unit));
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
  if (std::ranges::any_of(panel.series,
                          [](const PanelSeries& entry) { return has_value_beyond(*entry.series); })) {
    panel.notes.push_back("values beyond 1e100 are cut");
    panel.is_known = true;
  }
  for (const PanelInstant& instant : panel.instants) {
    if (!values) values = Interval{instant.value, instant.value};
    values->low = std::min(values->low, instant.value);
    values->high = std::max(values->high, instant.value);
  }
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
  for (const PanelInstant& instant : panel.instants) {
    const double low = instant.value - instant.tolerance, high = instant.value + instant.tolerance;
    range.low = std::min(range.low, length > 0.0 ? std::max(low, reach.low) : low);
    range.high = std::max(range.high, length > 0.0 ? std::min(high, reach.high) : high);
  }
  panel.range = with_margin(range, 0.06);
  constexpr std::size_t max_named = 8;
  for (const NamedValue& named : names) {
    if (named.value >= range.low && named.value <= range.high)
      panel.ticks.push_back({named.value, named.name});
  }
  if (panel.ticks.empty() || panel.ticks.size() > max_named) add_number_ticks(panel, 4);
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
  for (const SignalInstant& instant : plot.instants) {
    if (instant.series >= all.series.size() || !is_drawn(instant.value) || !is_drawn(instant.tolerance))
      continue;
    for (Panel& panel : panels) {
      const bool is_here = std::ranges::any_of(panel.series, [&](const PanelSeries& entry) {
        return entry.series == &all.series[instant.series];
      });
      if (is_here) panel.instants.push_back({instant.time_ns, instant.value, instant.tolerance});
    }
  }
  for (Panel& panel : panels)
    add_scale(panel);
  return panels;
}

}  // namespace hil::report
