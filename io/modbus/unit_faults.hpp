#pragma once
// Faults of a Modbus unit that a run injects, as what they do to its requests.
//
// Threads: add before the start; begin_cycle, hold and the notes on the device's thread; the rest on any
// thread.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "io/run_clock.hpp"

namespace hil::io::modbus {

/// What a fault does to the requests of a unit, or what several do together. The kinds of fault are
/// declared by the type of bus (runtime/buses/modbus/faults).
struct Interference {
  bool is_silent = false;        ///< no request is answered
  bool is_disconnected = false;  ///< there is no connection
  std::uint8_t exception = 0;    ///< the answer to each request; 0: the true one
  std::chrono::nanoseconds delay{0};
  bool lets_no_reply_through() const noexcept { return is_silent || is_disconnected; }
  /// Whether it does nothing but delay replies.
  bool only_delays() const noexcept { return !lets_no_reply_through() && exception == 0; }
};

/// In lock-step: what faults do to the cycle of a tick.
struct LockstepHold {
  bool is_held = false;         ///< there is no cycle in this tick
  const char* fault = nullptr;  ///< why the unit does not reply at all; null: it does
};

class UnitFaults {
 public:
  void add(const Interference& injected) { faults_.push_back(std::make_unique<Fault>(injected)); }
  const Interference& injected(std::size_t number) const noexcept { return faults_[number]->injected; }
  void set(std::size_t number, bool active) noexcept {
    faults_[number]->active.store(active, std::memory_order_release);
  }
  std::uint64_t count(std::size_t number) const noexcept {
    return faults_[number]->requests.load(std::memory_order_relaxed);
  }
  std::uint64_t effects(std::size_t number) const noexcept {
    return faults_[number]->effects.load(std::memory_order_relaxed);
  }
  /// A request came, or would have come, while the active faults act.
  void note_request() noexcept {
    for (const auto& fault : faults_) {
      if (!fault->is_active() && !fault->acts_in_cycle) continue;
      fault->requests.fetch_add(1, std::memory_order_relaxed);
      if (fault->held > 0)
        --fault->held;
      else
        fault->effects.fetch_add(1, std::memory_order_relaxed);
    }
  }
  /// For good, since nothing may keep safe values from the unit. Any thread.
  void end_all() noexcept { is_ended_.store(true, std::memory_order_release); }

  /// What the active faults do together.
  Interference interference() const noexcept {
    Interference all;
    if (is_ended_.load(std::memory_order_acquire)) return all;
    for (const auto& fault : faults_) {
      if (!fault->is_active()) continue;
      const Interference& injected = fault->injected;
      all.is_silent |= injected.is_silent;
      all.is_disconnected |= injected.is_disconnected;
      if (injected.exception != 0) all.exception = injected.exception;
      all.delay = std::max(all.delay, injected.delay);
    }
    return all;
  }

  /// Of a client: a cycle begins, and the active faults act on all its requests. A cycle that a fault
  /// disconnects counts as one request.
  Interference begin_cycle() noexcept {
    for (const auto& fault : faults_)
      fault->acts_in_cycle = fault->is_active();
    const Interference all = interference();
    if (all.is_disconnected) note_request();
    return all;
  }
  /// Of a client in lock-step, before a cycle. `is_away`: the program of the unit does not run.
  /// `reply_due_ns`: when a delayed reply comes; kept from tick to tick.
  LockstepHold hold(bool is_away, RunTimeNs tick_ns, std::chrono::nanoseconds timeout,
                    std::optional<RunTimeNs>& reply_due_ns) noexcept {
    const bool was_held = reply_due_ns.has_value();
    const LockstepHold hold = hold_of(interference(), is_away, tick_ns, timeout, reply_due_ns);
    if (hold.fault != nullptr) note_request();
    if (reply_due_ns && !was_held) note_held_request();
    return hold;
  }

  /// The active faults delay the reply to a request: an effect, also if they end before the reply, which
  /// note_request() counts.
  void note_held_request() noexcept {
    for (const auto& fault : faults_) {
      if (!fault->is_active()) continue;
      fault->effects.fetch_add(1, std::memory_order_relaxed);
      ++fault->held;
    }
  }

 private:
  static LockstepHold hold_of(const Interference& interference, bool is_away, RunTimeNs tick_ns,
                              std::chrono::nanoseconds timeout, std::optional<RunTimeNs>& reply_due_ns) {
    if (is_away) return {true, "the program of the unit does not run, by a fault of the scenario"};
    if (interference.lets_no_reply_through()) return {true, "no reply, by a fault of the scenario"};
    if (interference.delay.count() == 0) {
      reply_due_ns.reset();
      return {};
    }
    if (!reply_due_ns) reply_due_ns = tick_ns + std::min(interference.delay, timeout).count();
    if (tick_ns < *reply_due_ns) return {true, nullptr};
    reply_due_ns.reset();
    if (interference.delay <= timeout) return {};
    return {true, "replies come too late, by a fault of the scenario"};
  }
  struct Fault {
    explicit Fault(const Interference& interference) : injected(interference) {}
    bool is_active() const noexcept { return active.load(std::memory_order_acquire); }
    const Interference injected;
    std::atomic<bool> active{false};
    std::atomic<std::uint64_t> requests{0}, effects{0};
    // Of the device's thread.
    bool acts_in_cycle = false;
    std::uint64_t held = 0;  ///< delayed requests, which are counted as effects already
  };
  std::vector<std::unique_ptr<Fault>> faults_;
  std::atomic<bool> is_ended_{false};
};

}  // namespace hil::io::modbus
