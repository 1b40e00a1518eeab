#pragma once
// A simulated device whose times, losses and revivals follow from a seed.
//
// One seed gives one sequence of events: only the engine thread draws random numbers, and the write helper
// thread works only in run_write_helper(), which waits until it is done.

#include <atomic>
#include <cstdint>
#include <random>
#include <span>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "tests/support/simulation/clock.hpp"

namespace hil::long_test {

class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}
  /// 0 to below `n`.
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }
  bool one_in(std::uint32_t n) { return below(n) == 0; }

 private:
  std::mt19937_64 engine_;
};

using tests::SimulatedClock;

/// Events of the device, for the driver of the simulation.
class DeviceEvents {
 public:
  virtual ~DeviceEvents() = default;
  virtual void run_begins(std::span<const rtstdb::query::Request> requests) = 0;
  /// After each chunk. True: the device is lost.
  virtual bool chunk_done(const rtstdb::store::RowSource& rows, const rtstdb::query::PreparedQuery& query,
                          bool last) = 0;
  virtual void run_ends(rtstdb::query::RunStatus status) = 0;
  /// Whether the write helper may work now. Then run_write_helper() is called between begin_wait and
  /// end_wait, and returns when the write helper has no more work.
  virtual bool may_run_write_helper() = 0;
  virtual void run_write_helper() = 0;
};

class SimulatedDevice final : public rtstdb::query::Executor {
 public:
  SimulatedDevice(Chance& chance, SimulatedClock& clock, DeviceEvents& events)
      : chance_(chance), clock_(clock), events_(events) {}

  rtstdb::query::RunReport run(const rtstdb::store::RowSource& rows,
                               std::span<const rtstdb::query::Request> requests,
                               const rtstdb::store::TimeSpan& times,
                               rtstdb::query::ExecutorCallbacks* callbacks) noexcept override;
  bool lost() const noexcept override { return lost_; }
  bool revive(rtstdb::query::ExecutorCallbacks* callbacks) noexcept override;
  rtstdb::Nanoseconds revival_takes() const noexcept override { return rtstdb::Nanoseconds(300'000); }

  /// The engine may retry a lost device once after the loss, after each failed run, and after each of these
  /// calls, independently of how often it checks.
  void retry() noexcept { retries_ = lost_; }
  /// Whether a retry is due or running. Any thread.
  bool will_be_retried() const noexcept { return retries_; }

 private:
  rtstdb::query::RunStatus run_chunks(const rtstdb::store::RowSource& rows,
                                      std::span<const rtstdb::query::Request> requests,
                                      rtstdb::query::ExecutorCallbacks* callbacks);
  void wait_for_device(rtstdb::query::ExecutorCallbacks* callbacks);

  Chance& chance_;
  SimulatedClock& clock_;
  DeviceEvents& events_;
  bool lost_ = false;
  std::atomic<bool> retries_{false};
};

}  // namespace hil::long_test
