#pragma once
// What all parts of a run share: the scenario, the options, the user's request to stop, the clocks, run.log,
// and the list of degraded properties.
//
// Threads: DegradedList and RunLog as stated there; the rest is constant.

#include <algorithm>
#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/executive/clock.hpp"
#include "runtime/run/clocks.hpp"
#include "runtime/run/run_log.hpp"
#include "runtime/run/session.hpp"

namespace hil::run {

/// Sentences on what the machine does not permit, each once. Any thread.
class DegradedList {
 public:
  void add(const std::string& sentence) {
    const std::lock_guard lock(mutex_);
    if (std::find(all_.begin(), all_.end(), sentence) == all_.end()) all_.push_back(sentence);
  }
  std::vector<std::string> all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> all_;
};

class RunContext {
  executive::MonotonicClock monotonic_clock_;
  executive::VirtualClock virtual_clock_;

 public:
  /// Throws io::DeviceError when run.log can not be written. All arguments outlive it.
  RunContext(const config::Scenario& run_scenario, const SessionOptions& run_options,
             const std::atomic<bool>& stop_requested_by_user)
      : scenario(run_scenario),
        options(run_options),
        stop_requested(stop_requested_by_user),
        is_virtual(run_scenario.clock == config::ClockKind::virtual_time),
        database_clock(clock()),
        device_clock(clock()),
        log(run_options.directory / "run.log", run_options.verbose) {}

  executive::Clock& clock() noexcept {
    return is_virtual ? static_cast<executive::Clock&>(virtual_clock_)
                      : static_cast<executive::Clock&>(monotonic_clock_);
  }
  io::Pacing pacing() const noexcept { return is_virtual ? io::Pacing::lockstep : io::Pacing::realtime; }

  const config::Scenario& scenario;
  const SessionOptions& options;
  const std::atomic<bool>& stop_requested;  ///< by the user
  const bool is_virtual;
  DatabaseClock database_clock;
  DeviceClock device_clock;
  RunLog log;
  DegradedList degraded;
};

}  // namespace hil::run
