#pragma once
// report.html: one self-contained file without fonts, images, scripts or links from elsewhere; light or dark
// by the setting of the reader's system; printable. Its script adds zoom and values to the plots of signals.

#include <string>

#include "runtime/report/run_record.hpp"

namespace hil::report {

std::string report_html(const RunRecord& record);

}  // namespace hil::report
