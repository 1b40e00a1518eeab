#pragma once
// One run: opens what a wired scenario needs, runs the executive, closes everything, and returns the record
// for the report.
//
// Order of opening: database (the threads of its driver must not inherit real-time scheduling), scenery,
// modules, buses, processes, then the devices that communicate with those processes. Closing has the
// reverse order. Outputs get their safe values first, whatever ended the run.
//
// Threads: one ordinary thread, which is the executive's base thread during the run.

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/report/report_text.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/report/trace_json.hpp"
#include "runtime/run/fail_on.hpp"
#include "runtime/run/verdict.hpp"
#include "runtime/run/wiring.hpp"

namespace hil::run {

/// There is no usable GPU or driver. A sentence for the user.
class GpuError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The database got no memory or no thread. A sentence for the user.
class MemoryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The user stopped the run before it began. A sentence for the user.
class StoppedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct SessionOptions {
  std::filesystem::path directory;  ///< of the run's files; it exists (RunFolder)
  std::vector<report::Override> overrides;
  std::optional<FailOn> fail_on;
  std::vector<std::filesystem::path> program_folders;  ///< searched before PATH for programs without '/'
  bool announces_begin = false;                        ///< on stderr too, in one line
  std::function<void(const report::LiveStatus&)> every_second;  ///< called on another thread; may be empty
  bool verbose = false;                                         ///< copies run.log to stderr
};

struct SessionResult {
  report::RunRecord record;
  std::optional<report::TraceRecord> trace;  ///< empty: the scenario wants none
};

/// The record of a run that did not begin, or without any result: no expectation was checked.
report::RunRecord record_of_refusal(const config::Scenario& scenario, const SessionOptions& options,
                                    report::Verdict verdict, int exit_code, const std::string& reason);

/// Runs to the end, or until `stop_requested`. Throws StoppedError, GpuError, MemoryError, io::DeviceError,
/// modules::SetupError or an exception of the standard library when the run can not begin. Later faults are
/// in the record.
SessionResult run_session(Wiring wiring, const SessionOptions& options,
                          const std::atomic<bool>& stop_requested);

}  // namespace hil::run
