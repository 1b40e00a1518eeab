#pragma once
// junit.xml: one test case per expectation, one for the run ("run completed") and one for its timing ("timing
// not broken"), with buses one for their inputs ("inputs came and were accepted"), so that a CI system shows
// them separately and the set of cases is the same in every run.

#include <string>

#include "runtime/report/run_record.hpp"

namespace hil::report {

/// The time of a test case is the run time in seconds at which its result was decided: the first failure of
/// an expectation, the instant at which an `eventually` became true, else the end of the run. The time of
/// the suite is wall-clock time. "run completed" is an error for io_failed, gpu_failed, interrupted and
/// refused; "timing not broken" is a failure for timing_broken. Its system-out has the misses and skipped
/// ticks that the verdict tolerates.
std::string junit_xml(const RunRecord& record);

/// The file of a run that was refused before its scenario was known: one test case, "run completed", with an
/// error. `scenario`: its name, or that of its file. The first line of `mistakes` is the message of the
/// error, all of them are its text.
std::string refusal_junit_xml(const std::string& scenario, const std::string& mistakes);

}  // namespace hil::report
