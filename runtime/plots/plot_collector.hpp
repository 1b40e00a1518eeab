#pragma once
// The plots of a run: those of the scenario, and one for each set of signals that expectations read, with the
// limits of their conditions and the values that test tables expect. A signal on which a fault acts has its
// faulted values beside it.
//
// A series has between 2,000 and 4,000 buckets once the run has as many ticks. The plots of expectations have
// at most 64 series in all; what has no place is listed in PlotCollector::not_plotted.
//
// Threads: take on the base thread, once a tick, without allocation; the rest on the thread that opens and
// closes the run.

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/expectations/plot_content.hpp"
#include "runtime/plots/series_buckets.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::plots {

class PlotCollector {
 public:
  /// The names in the scenario are known.
  PlotCollector(const config::Scenario& scenario, const signals::SignalTable& table);

  void take(const signals::SignalTable& table, std::int64_t time_ns) noexcept;

  /// `record` has the results of the expectations, in the order of the scenario. Plots of those that did not
  /// hold come first, then those of the scenario, then the others.
  void fill(const signals::SignalTable& table, std::int64_t end_ns, report::RunRecord& record) const;

 private:
  struct Series {
    signals::SignalId signal;
    report::SeriesKind kind = report::SeriesKind::signal;
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;  ///< later values are not taken
    SeriesBuckets buckets;
  };
  struct Reference {
    expectations::PlotReference drawn;
    std::size_t expectation = 0;  ///< its number
  };
  struct Plot {
    std::string title;
    std::vector<std::size_t> expectations{};  ///< indices
    std::vector<std::size_t> series{};        ///< indices
    std::vector<expectations::PlotLimit> limits{};
    std::vector<expectations::PlotInstant> instants{};
    std::vector<Reference> references{};
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
  };

  void add_section(const config::PlotSection& section, const signals::SignalTable& table);
  void add_expectation(std::size_t index, const config::Scenario& scenario,
                       const signals::SignalTable& table);
  /// Adds the series of the signals to the plot, with their faulted ones.
  void add_series(const std::vector<signals::SignalId>& signals, const signals::SignalTable& table,
                  Plot& plot);
  /// `shift_ns`: by which it is drawn later.
  report::SignalSeries reference_series(const expectations::PlotReference& reference, std::int64_t shift_ns,
                                        const signals::SignalTable& table, std::int64_t end_ns) const;

  std::int64_t period_ns_;
  std::vector<Series> series_;
  std::vector<Plot> plots_;
  std::size_t sections_ = 0;  ///< the first plots, those of the scenario
  std::size_t expectation_series_ = 0;
  std::vector<std::string> not_plotted_;
};

}  // namespace hil::plots
