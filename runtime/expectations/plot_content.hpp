#pragma once
// What the plot of an expectation shows: the signals that it reads, and the constants that it compares them
// with, at instants for test tables.
//
// Threads: the one that opens the run.

#include <cstdint>
#include <optional>
#include <vector>

#include "runtime/config/expression.hpp"
#include "runtime/signals/csv_profile.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

struct PlotLimit {
  signals::SignalId signal;
  double value = 0.0;  ///< in the unit of the signal
};

/// A curve that the signal has to follow, within the tolerance, both in the unit of the signal.
struct PlotReference {
  signals::SignalId signal;
  signals::CsvProfile curve;
  double tolerance = 0.0;
};

/// What a test table expects of the signal at an instant, in the unit of the signal.
struct PlotInstant {
  signals::SignalId signal;
  std::int64_t time_ns = 0;
  double value = 0.0;
  double tolerance = 0.0;
};

struct PlotContent {
  std::vector<signals::SignalId> signals{};  ///< each once
  std::vector<PlotLimit> limits{};
  std::vector<PlotInstant> instants{};
  std::optional<PlotReference> reference{};

  void add(signals::SignalId signal);
  /// The signals of the condition, and the limits of comparisons of a signal with a constant by < <= > >=.
  void add(const config::Expression& condition, const signals::SignalTable& table);
};

PlotContent plot_of(signals::SignalId signal);
PlotContent plot_of(const config::Expression& condition, const signals::SignalTable& table);

}  // namespace hil::expectations
