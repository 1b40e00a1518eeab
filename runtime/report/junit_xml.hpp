#pragma once
// junit.xml: one test case per expectation, one for the run itself ("run completed") and one for its timing
// ("timing not broken"), so that a CI system shows them one by one and the set is the same from run to run.

#include <string>

#include "runtime/report/run_record.hpp"

namespace hil::report {

/// A test case's time is the run time in seconds at which its result was decided: the first failure of an
/// expectation, the instant at which an `eventually` came true, else the end of the run. The time of the
/// suite is wall-clock time. "run completed" is an error for io_failed, gpu_failed, interrupted and refused;
/// "timing not broken" a failure for timing_broken. Misses and ticks given up that the verdict tolerates
/// stand in the case's system-out.
std::string junit_xml(const RunRecord& record);

}  // namespace hil::report
