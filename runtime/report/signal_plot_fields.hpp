#pragma once
// The keys of the plots of signals in report.json. A part of record_fields.hpp.

#include "runtime/report/record_field.hpp"
#include "runtime/report/signal_plot_record.hpp"

namespace hil::report {

template <Is<NamedValue> T, class Visit>
void each_field(T& named, Visit&& visit) {
  visit("value", named.value);
  visit("name", named.name);
}

template <Is<SignalSeries> T, class Visit>
void each_field(T& series, Visit&& visit) {
  visit("name", series.name);
  visit("kind", series.kind);
  visit("unit", series.unit);
  visit("tolerance", series.tolerance);
  visit("named_values", series.named_values);
  visit("begin_ns", series.begin_ns);
  visit("bucket_ns", series.bucket_ns);
  visit("points", series.points);
}

template <Is<SignalLimit> T, class Visit>
void each_field(T& limit, Visit&& visit) {
  visit("series", limit.series);
  visit("value", limit.value);
}

template <Is<SignalInstant> T, class Visit>
void each_field(T& instant, Visit&& visit) {
  visit("series", instant.series);
  visit("time_ns", instant.time_ns);
  visit("value", instant.value);
  visit("tolerance", instant.tolerance);
}

template <Is<SignalPlot> T, class Visit>
void each_field(T& plot, Visit&& visit) {
  visit("title", plot.title);
  visit("expectations", plot.expectations);
  visit("series", plot.series);
  visit("limits", plot.limits);
  visit("instants", plot.instants);
  visit("begin_ns", plot.begin_ns);
  visit("end_ns", plot.end_ns);
}

template <Is<SignalPlots> T, class Visit>
void each_field(T& plots, Visit&& visit) {
  visit("series", plots.series);
  visit("plots", plots.plots);
  visit("not_plotted", plots.not_plotted);
}

}  // namespace hil::report
