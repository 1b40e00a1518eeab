#pragma once
// --fail-on: the condition under which the timing of a run counts as broken.

#include <optional>
#include <string>

#include <hil/diagnostics.hpp>

#include "runtime/executive/result.hpp"
#include "runtime/expression/program.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::run {

struct FailOn {
  std::string text;  ///< as the user wrote it
  expression::Program condition;
};

/// A condition over the counts of a run: misses, overruns, skipped (releases), aborted, over_budget,
/// skipped_ticks, lost_records, hard_misses, without_result (runs of tasks). Empty with mistakes when the
/// text is no such condition.
std::optional<FailOn> parse_fail_on(const std::string& text, config::Diagnostics& diagnostics);

/// Whether the condition, of parse_fail_on, holds for the run.
bool timing_broken(const FailOn& fail_on, const executive::RunResult& result,
                   const report::RunRecord& record);

}  // namespace hil::run
