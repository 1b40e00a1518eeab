#pragma once
// The plot of signals as a picture: lanes that show when stimuli and faults were active and when events were,
// panels with the signals over run time (signal_panels.hpp), limits, and lines at the first failure and the
// worst moment of expectations.
//
// The picture is as wide as its page; only the content of its windows (class "window") is stretched. The
// horizontal unit of a window is the narrowest bucket of its signals, so that a script of the page can show a
// part of it by the viewBox alone. The path of a signal has one M or l for each value, v to the other end of
// a range of values, and h for as long as a value stays.

#include "runtime/report/html/svg.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

/// The most lanes of stimuli and faults, the first ones.
inline constexpr std::size_t max_lanes = 12;

void draw_signal_chart(Markup& out, const RunRecord& record, const SignalPlot& plot, PictureUse use);

}  // namespace hil::report
