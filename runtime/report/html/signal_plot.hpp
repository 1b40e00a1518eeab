#pragma once
// The plot of signals as a picture: lanes that show when stimuli and faults were active and when events were,
// panels with the signals over run time (signal_panels.hpp), limits, the values that test tables expect, and
// lines where an expectation first failed, had its least margin, or was met.
//
// The picture is as wide as its page; only the content of its viewports (class "viewport") is stretched. A
// column of a viewport is the narrowest bucket of its signals, so that a script of the page can show a part
// of it by the viewBox alone. The path of a signal has one M or l for each value, v to the other end of a
// range of values, and h for as long as a value stays.

#include "runtime/report/html/svg.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

/// Pixels beside the area of the signals, which is 100 % wide; the margins in page_style().
inline constexpr double signal_plot_left_gutter = 56.0;
inline constexpr double signal_plot_right_gutter = 66.0;

void draw_signal_plot(Markup& out, const RunRecord& record, const SignalPlot& plot, PictureUse use);

}  // namespace hil::report
