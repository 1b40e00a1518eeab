#pragma once
// One run: opens everything a wired scenario asks for, lets the executive run it, closes everything in order,
// and leaves the record that the report is made of.
//
// Order of opening: database (its driver's threads must not inherit real-time scheduling), static world,
// modules, buses, processes, then the devices that talk to those processes. Closing goes the other way;
// outputs go to their safe values first, whatever ended the run.
//
// Threads: one ordinary thread, which becomes the executive's base thread for the time of the run.

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

/// The GPU or its driver can not be had. A sentence for the user.
class GpuError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The database got no memory or no thread. A sentence for the user.
class MemoryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct SessionOptions {
  std::filesystem::path directory;  ///< what the run leaves goes here; it is there (RunFolder)
  std::vector<report::Override> overrides;
  std::optional<config::Condition> fail_on;
  std::vector<std::filesystem::path>
      program_folders;  ///< where programs without '/' are looked for before PATH
  std::function<void(const report::LiveStatus&)> every_second;  ///< on a thread of its own; may be empty
  bool verbose = false;                                         ///< what run.log holds goes to stderr too
};

struct SessionResult {
  report::RunRecord record;
  report::TraceRecord trace;
};

/// The record of a run that did not begin, or of which no more is known: no expectation was checked.
report::RunRecord record_of_refusal(const config::Scenario& scenario, const SessionOptions& options,
                                    report::Verdict verdict, int exit_code, const std::string& why);

/// Runs to the end, or until `stop_requested`. Throws GpuError, MemoryError, io::DeviceError,
/// modules::SetupError or an exception of the standard library when the run can not begin; trouble after that
/// is in the record.
SessionResult run_session(Wiring wiring, const SessionOptions& options,
                          const std::atomic<bool>& stop_requested);

}  // namespace hil::run
