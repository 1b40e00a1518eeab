#pragma once
// The line of a series in the viewport of a panel (signal_plot.hpp).

#include <cstdint>
#include <string>

#include "runtime/report/html/axis.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

/// The coordinates of a viewport: x in columns from the start of the plot, y down from the upper end of the
/// panel's range to viewport_height.
struct ViewportScale {
  std::int64_t begin_ns = 0;
  std::int64_t column_ns = 1;
  Interval range;
};
inline constexpr double viewport_height = 10000.0;

/// In columns, not rounded.
double x_at(const ViewportScale& scale, std::int64_t time_ns);
/// Values outside the range are at its ends.
long y_at(const ViewportScale& scale, double value);

/// Interrupted where the value is not known. Empty: it never is.
std::string signal_path(const SignalSeries& series, const ViewportScale& scale, bool is_discrete);
/// A dot at the begin of each part of the line that is shorter than `min_columns`, and so hard to see. Empty:
/// there is none.
std::string dots_path(const SignalSeries& series, const ViewportScale& scale, double min_columns);
/// The area within the tolerance of a reference.
std::string tolerance_path(const SignalSeries& reference, const ViewportScale& scale);

}  // namespace hil::report
