#pragma once
// The script of the page: zoom and values of the plots of signals (signal_plot.hpp). Without it the page has
// the whole plots.

#include <string_view>

namespace hil::report {

/// Without '<' and '&', so that the page is well-formed XML.
std::string_view plot_script();

}  // namespace hil::report
