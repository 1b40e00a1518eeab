#include "runtime/plots/plot_collector.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "runtime/expectations/kinds.hpp"

namespace hil::plots {
namespace {

constexpr std::int64_t no_end = std::numeric_limits<std::int64_t>::max();

/// Differs between series, so that they do not all merge their buckets in the same tick.
std::size_t capacity_of(std::size_t series) {
  return 4000 + 2 * (series % 64);
}

/// The signals with the faulted ones behind them, each once.
std::vector<std::pair<signals::SignalId, report::SeriesKind>> with_faulted(
    const std::vector<signals::SignalId>& signals, const signals::SignalTable& table) {
  std::vector<std::pair<signals::SignalId, report::SeriesKind>> all;
  const auto add = [&](signals::SignalId signal, report::SeriesKind kind) {
    const auto existing = std::ranges::find(all, signal, &decltype(all)::value_type::first);
    if (existing == all.end()) all.emplace_back(signal, kind);
  };
  for (const signals::SignalId signal : signals) {
    add(signal, report::SeriesKind::signal);
    if (const auto faulted = table.find(table.info(signal).name + std::string(signals::faulted_suffix)))
      add(*faulted, report::SeriesKind::faulted);
  }
  return all;
}

std::vector<report::NamedValue> named_values_of(const signals::SignalInfo& info) {
  std::vector<report::NamedValue> values;
  for (const auto& [name, value] : info.named_values)
    values.push_back({.value = value, .name = name});
  return values;
}

}  // namespace

PlotCollector::PlotCollector(const config::Scenario& scenario, const signals::SignalTable& table)
    : period_ns_(scenario.base_period_ns) {
  for (const config::PlotSection& section : scenario.plots)
    add_section(section, table);
  sections_ = plots_.size();
  for (std::size_t i = 0; i < scenario.expectations.size(); ++i)
    add_expectation(i, scenario, table);
}

void PlotCollector::add_section(const config::PlotSection& section, const signals::SignalTable& table) {
  std::vector<signals::SignalId> signals;
  for (const config::Word& name : section.signals)
    signals.push_back(*table.find(name.text));
  const std::int64_t from_ns = section.from_ns.value_or(0);
  Plot plot{.title = section.title,
            .begin_ns = (from_ns + period_ns_ - 1) / period_ns_ * period_ns_,
            .end_ns = section.until_ns.value_or(no_end)};
  add_series(signals, table, plot);
  plots_.push_back(std::move(plot));
}

void PlotCollector::add_expectation(std::size_t index, const config::Scenario& scenario,
                                    const signals::SignalTable& table) {
  const config::Expectation& expectation = scenario.expectations[index];
  expectations::PlotContent content = expectations::plot_content(expectation, table);
  if (content.signals.empty()) return;
  Plot plot{.title = expectation.name, .end_ns = no_end};
  const std::size_t before = series_.size();
  add_series(content.signals, table, plot);
  const auto same_plot = std::find_if(plots_.begin() + static_cast<std::ptrdiff_t>(sections_), plots_.end(),
                                      [&](const Plot& other) { return other.series == plot.series; });
  expectation_series_ += series_.size() - before;
  if (expectation_series_ > report::max_expectation_series) {
    expectation_series_ -= series_.size() - before;
    series_.erase(series_.begin() + static_cast<std::ptrdiff_t>(before), series_.end());
    not_plotted_.push_back(expectation.name);
    return;
  }
  Plot& kept = same_plot == plots_.end() ? plots_.emplace_back(std::move(plot)) : *same_plot;
  kept.expectations.push_back(index);
  for (const expectations::PlotLimit& limit : content.limits)
    kept.limits.push_back(limit);
  for (const expectations::PlotInstant& instant : content.instants)
    kept.instants.push_back(instant);
  if (content.reference) kept.references.push_back({std::move(*content.reference), index});
}

void PlotCollector::add_series(const std::vector<signals::SignalId>& signals,
                               const signals::SignalTable& table, Plot& plot) {
  for (const auto& [signal, kind] : with_faulted(signals, table)) {
    const auto existing =
        std::find_if(series_.begin(), series_.end(), [&, id = signal](const Series& series) {
          return series.signal == id && series.begin_ns == plot.begin_ns && series.end_ns == plot.end_ns;
        });
    plot.series.push_back(static_cast<std::size_t>(existing - series_.begin()));
    if (existing != series_.end()) continue;
    series_.push_back({.signal = signal,
                       .kind = kind,
                       .begin_ns = plot.begin_ns,
                       .end_ns = plot.end_ns,
                       .buckets = SeriesBuckets(capacity_of(series_.size()))});
  }
}

void PlotCollector::take(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  for (Series& series : series_) {
    if (time_ns < series.begin_ns || time_ns > series.end_ns) continue;
    series.buckets.add(static_cast<std::uint64_t>((time_ns - series.begin_ns) / period_ns_),
                       table.is_known(series.signal) ? table.value(series.signal) : contribution::not_known);
  }
}

report::SignalSeries PlotCollector::reference_series(const expectations::PlotReference& reference,
                                                     std::int64_t shift_ns, const signals::SignalTable& table,
                                                     std::int64_t end_ns) const {
  const signals::SignalInfo& info = table.info(reference.signal);
  signals::CsvProfile curve = reference.curve;
  curve.rewind();
  SeriesBuckets buckets(capacity_of(0));
  for (std::int64_t time_ns = 0; time_ns < end_ns; time_ns += period_ns_) {
    const std::int64_t of_curve_ns = time_ns - shift_ns;
    const bool has_value = of_curve_ns >= curve.begin_ns() && of_curve_ns <= curve.end_ns();
    buckets.add(static_cast<std::uint64_t>(time_ns / period_ns_),
                has_value ? curve.at(of_curve_ns) : contribution::not_known);
  }
  return {.name = info.name,
          .kind = report::SeriesKind::reference,
          .unit = info.unit,
          .tolerance = reference.tolerance,
          .named_values = {},
          .begin_ns = 0,
          .bucket_ns = static_cast<std::int64_t>(buckets.ticks_per_bucket()) * period_ns_,
          .points = buckets.points()};
}

void PlotCollector::fill(const signals::SignalTable& table, std::int64_t end_ns,
                         report::RunRecord& record) const {
  report::SignalPlots& filled = record.signal_plots;
  for (const Series& series : series_) {
    const signals::SignalInfo& info = table.info(series.signal);
    filled.series.push_back(
        {.name = info.name,
         .kind = series.kind,
         .unit = info.unit,
         .named_values = named_values_of(info),
         .begin_ns = series.begin_ns,
         .bucket_ns = static_cast<std::int64_t>(series.buckets.ticks_per_bucket()) * period_ns_,
         .points = series.buckets.points()});
  }
  std::vector<const Plot*> plots;
  for (const Plot& plot : plots_)
    plots.push_back(&plot);
  std::ranges::stable_partition(plots, [&](const Plot* plot) {
    return std::ranges::any_of(plot->expectations, [&](std::size_t index) {
      return record.expectations[index].result != report::ExpectationResult::held;
    });
  });
  for (const Plot* const plot : plots) {
    report::SignalPlot written{.title = plot->title,
                               .expectations = {plot->expectations.begin(), plot->expectations.end()},
                               .series = {plot->series.begin(), plot->series.end()},
                               .limits = {},
                               .begin_ns = plot->begin_ns,
                               .end_ns = std::max(plot->begin_ns, std::min(plot->end_ns, end_ns))};
    const auto series_of = [&](signals::SignalId signal) {
      const auto found =
          std::ranges::find(plot->series, signal, [&](std::size_t i) { return series_[i].signal; });
      return static_cast<std::uint32_t>(*found);
    };
    for (const expectations::PlotLimit& limit : plot->limits)
      written.limits.push_back({.series = series_of(limit.signal), .value = limit.value});
    for (const expectations::PlotInstant& instant : plot->instants) {
      written.instants.push_back({.series = series_of(instant.signal),
                                  .time_ns = instant.time_ns,
                                  .value = instant.value,
                                  .tolerance = instant.tolerance});
    }
    for (const Reference& reference : plot->references) {
      written.series.push_back(static_cast<std::uint32_t>(filled.series.size()));
      filled.series.push_back(reference_series(
          reference.drawn, record.expectations[reference.expectation].shift_ns, table, end_ns));
    }
    filled.plots.push_back(std::move(written));
  }
  filled.not_plotted = not_plotted_;
}

}  // namespace hil::plots
