#pragma once
// A transaction as the scheduler sees it: its terms, its work, and what the scheduler has decided about it.
//
// Threads: the owner's while it declares; from submission to outcome, the thread that holds the engine's
// lock. The functions about cancelling are safe in any thread.

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/transaction.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/hand_over.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::scheduler {

class ReservationImpl;

class ScheduledTransaction : public HandOverLink {
 public:
  ScheduledTransaction(const ScheduledTransaction&) = delete;
  ScheduledTransaction& operator=(const ScheduledTransaction&) = delete;

  // ---- what is declared
  const Terms& terms() const noexcept { return terms_; }
  bool is(DeadlineClass deadline_class) const noexcept { return terms_.deadline_class == deadline_class; }
  void set_deadline_if_none(ClockTime deadline) noexcept {
    if (terms_.deadline == ClockTime::max()) terms_.deadline = deadline;
  }
  /// The reservation that its terms name, or null.
  ReservationImpl* reservation() const noexcept;
  store::WriteSet& write_set() noexcept { return write_set_; }
  const store::WriteSet& write_set() const noexcept { return write_set_; }
  std::span<query::Request> requests() noexcept { return requests_; }
  std::span<const query::Request> requests() const noexcept { return requests_; }
  bool writes() const noexcept { return !write_set_.empty(); }
  bool has_queries() const noexcept { return !requests_.empty(); }

  // ---- its outcome
  const Outcome& outcome() const noexcept { return outcome_; }
  /// The outcome while the engine fills it in.
  Outcome& draft() noexcept { return outcome_; }
  /// Notes by how much its deadline has passed at `now`; the difference saturates.
  void note_lateness(ClockTime now) noexcept;

  // ---- cancelling
  bool cancel_requested() const noexcept { return cancel_requested_.load(std::memory_order_acquire); }

  // ---- set by Admission
  std::uint64_t arrival = 0;     ///< number of admission, for the order among equals
  bool cost_known = false;       ///< the cost model predicted it
  Nanoseconds promised_cost{0};  ///< predicted with a safety margin; zero: not known
  /// Of that, what it needs to be done in time: queries whose answers may be partial count one chunk
  /// together.
  Nanoseconds required_cost{0};
  bool promised = false;  ///< firm, and admitted because it will be in time
  Nanoseconds slack{0};   ///< promised: the cost that may still be scheduled before it

  // ---- set by Reservations
  bool reserved = false;  ///< it is scheduled before all that are not
  ClockTime due{};        ///< reserved: its deadline in the order of reserved ones

 protected:
  ScheduledTransaction() = default;
  ~ScheduledTransaction() = default;

  Terms terms_;
  store::WriteSet write_set_;
  std::vector<query::Request> requests_;
  Outcome outcome_;
  std::atomic<bool> cancel_requested_{false};
};

}  // namespace rtstdb::scheduler
