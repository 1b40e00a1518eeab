#pragma once
// Converts the results of the executive into the report's record.

#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/executive/result.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/report/trace_json.hpp"

namespace hil::run {

/// Fills in what the executive measured. The scenario gives budget and overrun policy; a task that it does
/// not list is a device's.
void take_executive(const executive::RunResult& result, const config::Scenario& scenario,
                    report::RunRecord& record);
report::TraceRecord trace_of(const executive::RunResult& result, const std::vector<report::Event>& events);

}  // namespace hil::run
