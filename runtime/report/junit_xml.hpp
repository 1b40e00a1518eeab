#pragma once
// junit.xml: one test case per expectation, one for the run itself ("run completed") and one for its timing
// ("timing kept"), so that a CI system shows them one by one and the set is the same from run to run.

#include <string>

#include "runtime/report/run_record.hpp"

namespace hil::report {

/// "run completed" is an error for io_failed, gpu_failed, interrupted and refused; "timing kept" a failure for
/// timing_broken. Misses of a run whose verdict tolerates them are listed in the case's system-out.
std::string junit_xml(const RunRecord& record);

}  // namespace hil::report
