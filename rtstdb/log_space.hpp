#pragma once
// How setup calls that record something in the log wait for space in its ring.

#include <chrono>
#include <thread>

#include <rtstdb/result.hpp>

#include "rtstdb/transaction/engine.hpp"

namespace rtstdb {

/// How long a setup call waits for space in the log.
constexpr std::chrono::seconds log_space_timeout{10};

/// Calls `work` on the engine thread until `is_done` holds. Errors: file, if the log has no space for it
/// within log_space_timeout.
template <class Work, class IsDone>
Result<void> call_until(transaction::Engine& engine, const Work& work, const IsDone& is_done) {
  const auto begun_at = std::chrono::steady_clock::now();
  for (engine.call(work); !is_done(); engine.call(work)) {
    if (std::chrono::steady_clock::now() - begun_at > log_space_timeout)
      return Error{ErrorCode::file, "the log has no room: " + engine.log()->state().last_fault};
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return {};
}

}  // namespace rtstdb
