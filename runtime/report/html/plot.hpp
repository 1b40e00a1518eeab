#pragma once
// A plot of a section: lines with dots at their points, on linear or logarithmic axes, and a legend.

#include <hil/section.hpp>

#include "runtime/report/html/svg.hpp"

namespace hil::report {

/// Points that are not finite, beyond 1e100, or not positive on a logarithmic axis, are left out and
/// interrupt their line. For a plot without points it draws a sentence.
void draw_plot(Markup& out, const contribution::Plot& plot, PictureUse use);

}  // namespace hil::report
