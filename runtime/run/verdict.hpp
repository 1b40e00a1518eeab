#pragma once
// The verdict, exit code and reason of a run, from its record and from the state of the session.
//
// When several verdicts apply, the first of these counts: GPU, I/O, timing, interruption, expectations.

#include <optional>
#include <string>

#include "runtime/executive/result.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/fail_on.hpp"

namespace hil::run {

enum ExitCode : int {
  exit_passed = 0,
  exit_expectation_failed = 1,
  exit_bad_config = 2,
  exit_timing_broken = 3,
  exit_io_failed = 4,
  exit_gpu_failed = 5,
  exit_internal = 70,
  exit_interrupted = 130,  ///< as a shell reports SIGINT
};

struct VerdictInputs {
  const executive::RunResult& result;
  bool gpu_lost = false;
  bool interrupted = false;
  /// The share that may be lost of base ticks, of each task's releases, and of each bus's outputs, and that
  /// may have late hard transactions of each task's runs.
  double max_lost = 1.0;
  /// The number of runs of tasks with a late hard transaction that may be; empty: no limit but max_lost.
  std::optional<std::uint64_t> max_hard_misses{};
  const std::optional<FailOn>& fail_on;
};

/// Fills in the verdict, exit code and reason of a record that is complete otherwise. An entry in
/// record.failures is an I/O failure.
void decide(const VerdictInputs& inputs, report::RunRecord& record);

}  // namespace hil::run
