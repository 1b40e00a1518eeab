#pragma once
// --fail-on: when a run counts as broken in its timing.

#include <optional>
#include <string>

#include "runtime/config/condition.hpp"
#include "runtime/executive/result.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::run {

/// A condition over the run's counts: misses, overruns, skipped (releases never run), aborted, over_budget,
/// skipped_ticks, lost_records, hard_misses, without_answer (runs of tasks). Empty with mistakes when it is not one.
std::optional<config::Condition> parse_fail_on(const std::string& text, config::Diagnostics& diagnostics);

/// `condition` comes from parse_fail_on.
bool timing_broken(const config::Condition& condition, const executive::RunResult& result,
                   const report::RunRecord& record);

}  // namespace hil::run
