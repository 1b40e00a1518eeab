#pragma once
// The line of a series in the window of a panel (signal_chart.hpp).

#include <cstdint>
#include <string>

#include "runtime/report/html/axis.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

/// The coordinates of a window: x in units of time from the begin of the plot, y down from the upper end of
/// the panel's range to window_height.
struct WindowScale {
  std::int64_t begin_ns = 0;
  std::int64_t unit_ns = 1;
  Interval range;
};
inline constexpr double window_height = 10000.0;

/// In units, not rounded.
double x_at(const WindowScale& scale, std::int64_t time_ns);
/// Values outside the range are at its ends.
long y_at(const WindowScale& scale, double value);

/// Interrupted where the value is not known. Empty: it never is.
std::string signal_path(const SignalSeries& series, const WindowScale& scale, bool has_steps);
/// The area within the tolerance of a reference.
std::string tolerance_path(const SignalSeries& reference, const WindowScale& scale);

}  // namespace hil::report
