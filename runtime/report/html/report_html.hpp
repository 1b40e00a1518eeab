#pragma once
// report.html: one file that holds everything it shows. No script, no font, image or link from elsewhere;
// light or dark as the reader's system asks; prints. What the record says nothing about is left out or said
// to be absent.

#include <string>

#include "runtime/report/run_record.hpp"

namespace hil::report {

std::string report_html(const RunRecord& record);

}  // namespace hil::report
