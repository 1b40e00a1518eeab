#pragma once
// A simulated device that takes time, is lost and comes back as a seed says.
//
// One seed is one course of events: chance is drawn on the engine thread alone, and the engine's other thread works in
// pauses() alone, which waits until it is done.

#include <atomic>
#include <cstdint>
#include <random>
#include <span>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "tests/support/simulation/clock.hpp"

namespace hil::stress {

class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}
  /// 0 to below `n`.
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }
  bool one_in(std::uint32_t n) { return below(n) == 0; }

 private:
  std::mt19937_64 engine_;
};

using test::SimulatedClock;

/// What happens in the device, told to whoever drives the simulation.
class DeviceEvents {
 public:
  virtual ~DeviceEvents() = default;
  virtual void run_begins(std::span<const rtstdb::query::Request> requests) = 0;
  /// A chunk has been carried out. True: the device was lost in it.
  virtual bool chunk_done(const rtstdb::store::RowSource& rows, const rtstdb::query::PreparedQuery& query,
                          bool last) = 0;
  virtual void run_ends(rtstdb::query::RunStatus status) = 0;
  /// Whether others are let in now; then pauses is called between begin_wait and end_wait, and returns when the
  /// engine's write helper has done all that there is to do.
  virtual bool may_pause() = 0;
  virtual void pauses() = 0;
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

  /// A lost device is tried once after it was lost, after each run that it could not do, and after each of these calls:
  /// not by how often the engine happens to look.
  void try_again() noexcept { tries_ = lost_; }
  /// Any thread; false: not before the next of them, and it is not being tried.
  bool will_be_tried() const noexcept { return tries_; }

 private:
  rtstdb::query::RunStatus run_chunks(const rtstdb::store::RowSource& rows,
                                      std::span<const rtstdb::query::Request> requests,
                                      rtstdb::query::ExecutorCallbacks* callbacks);
  void let_others_in(rtstdb::query::ExecutorCallbacks* callbacks);

  Chance& chance_;
  SimulatedClock& clock_;
  DeviceEvents& events_;
  bool lost_ = false;
  std::atomic<bool> tries_{false};
};

}  // namespace hil::stress
