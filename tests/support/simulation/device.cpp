#include "tests/support/simulation/device.hpp"

#include <algorithm>

namespace hil::long_test {

using rtstdb::Nanoseconds;
using rtstdb::query::ExecutorCallbacks;
using rtstdb::query::Request;
using rtstdb::query::RunReport;
using rtstdb::query::RunStatus;
using rtstdb::store::RowSource;

RunReport SimulatedDevice::run(const RowSource& rows, std::span<const Request> requests,
                               const rtstdb::store::TimeSpan& /*times*/,
                               ExecutorCallbacks* callbacks) noexcept {
  events_.run_begins(requests);
  const RunStatus status = lost_ ? RunStatus::device_lost : run_chunks(rows, requests, callbacks);
  if (lost_) retry();
  events_.run_ends(status);
  return {.status = status};
}

RunStatus SimulatedDevice::run_chunks(const RowSource& rows, std::span<const Request> requests,
                                      ExecutorCallbacks* callbacks) {
  // A run of one chunk has no preemption points.
  const bool divided = std::ranges::any_of(requests, [](const Request& one) { return one.per_chunk != 0; });
  for (std::size_t k = 0; k < requests.size(); ++k) {
    const Request& request = requests[k];
    const std::uint32_t step = request.per_chunk == 0 ? request.count : request.per_chunk;
    for (std::uint32_t first = 0; first < request.count; first += step) {
      const std::uint32_t elements = std::min(step, request.count - first);
      // Some chunks are ten times as expensive.
      const std::uint32_t each_ns = chance_.one_in(50) ? 900 : 90 + chance_.below(20);
      clock_.advance(Nanoseconds(2'000 + std::int64_t{elements} * each_ns));
      wait_for_device(callbacks);
      const bool last = k + 1 == requests.size() && first + elements == request.count;
      if (events_.chunk_done(rows, *request.query, last)) lost_ = true;
      if (lost_) return RunStatus::device_lost;
      if (last || callbacks == nullptr || !divided) continue;
      const auto continuation = callbacks->on_preemption_point();
      if (lost_) return RunStatus::device_lost;  // in a nested run
      if (continuation == ExecutorCallbacks::Continuation::stop) return RunStatus::stopped;
    }
  }
  return chance_.one_in(40) ? RunStatus::truncated : RunStatus::done;
}

bool SimulatedDevice::revive(ExecutorCallbacks* callbacks) noexcept {
  if (!retries_) return !lost_;
  wait_for_device(callbacks);
  clock_.advance(Nanoseconds(100'000 + std::int64_t{chance_.below(400'000)}));
  lost_ = chance_.one_in(4);
  retries_ = false;
  return !lost_;
}

void SimulatedDevice::wait_for_device(ExecutorCallbacks* callbacks) {
  if (callbacks == nullptr || !events_.may_run_write_helper()) return;
  callbacks->begin_wait();
  events_.run_write_helper();
  callbacks->end_wait();
}

}  // namespace hil::long_test
