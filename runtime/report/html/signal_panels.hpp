#pragma once
// How the signals of a plot share panels: those of one unit have one panel; a signal without a unit, or with
// names of values, has its own. The faulted signal and the reference are in the panel of their signal.

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/report/html/axis.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

struct PanelTick {
  double value = 0.0;
  std::string label;
};

struct PanelSeries {
  const SignalSeries* series = nullptr;
  std::size_t colour = 0;  ///< 0 to 7
};

/// What a test table expects of a signal at an instant.
struct PanelInstant {
  std::int64_t time_ns = 0;
  double value = 0.0;
  double tolerance = 0.0;
};

struct Panel {
  std::vector<PanelSeries> series;
  bool is_discrete = false;  ///< truths, whole numbers without a unit, named values: drawn as steps
  bool is_known = false;     ///< at least one value is known
  std::vector<double> limits;
  std::vector<PanelInstant> instants;
  std::vector<std::string>
      notes;       ///< what the picture does not show as it is, each in a line above the panel
  Interval range;  ///< of the vertical axis; limits may be outside
  std::vector<PanelTick> ticks;
  double height_px = 0.0;
};

/// Indices in `plot` without a series are left out. `all` outlives the panels.
std::vector<Panel> panels_of(const SignalPlots& all, const SignalPlot& plot);

}  // namespace hil::report
