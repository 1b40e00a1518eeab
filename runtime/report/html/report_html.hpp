#pragma once
// report.html: one self-contained file without scripts and without fonts, images or links from elsewhere;
// light or dark by the setting of the reader's system; printable.

#include <string>

#include "runtime/report/run_record.hpp"

namespace hil::report {

std::string report_html(const RunRecord& record);

}  // namespace hil::report
