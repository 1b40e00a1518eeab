#pragma once
// The reservations that were admitted, the transactions that use them, and how well they are kept. The
// contract for users is in rtstdb/reservation.hpp.
//
// A transaction is reserved from its release on: its deadline less the reservation's, or its submission if
// that is later, and at least a period after the release before. After a moment without reserved work
// releases count anew. So no length of time holds more work than the feasibility check assumed
// (reserved_demand.hpp), whatever the callers do. Whether one comes too often is judged by deadlines, so that
// a single late submission does not make all later ones late.
//
// Threads: add and remove by any, one at a time, while the engine executes nothing; the functions about
// transactions by the thread that holds the engine's lock, unless they say otherwise; counts by any.

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/scheduler/reserved_demand.hpp"

namespace rtstdb::scheduler {

class ReservationImpl;
class Reservations;
class ScheduledTransaction;

/// Who made a reservation.
class ReservationOwner {
 public:
  /// The reservation is being destroyed: it must be removed before this returns. Any thread.
  virtual void remove_reservation(ReservationImpl& reservation) noexcept = 0;

 protected:
  ~ReservationOwner() = default;
};

class ReservationImpl final : public Reservation {
 public:
  /// `owner` outlives it.
  ReservationImpl(ReservationOptions options, ReservationOwner& owner)
      : options_(std::move(options)), owner_(owner) {}
  /// Removes it. Misuse while a transaction that names it is pending.
  ~ReservationImpl() override;
  ReservationImpl(const ReservationImpl&) = delete;
  ReservationImpl& operator=(const ReservationImpl&) = delete;

  const ReservationOptions& options() const noexcept override { return options_; }
  ReservationCounts counts() const override;

 private:
  friend class Reservations;
  using Counter = std::atomic<std::uint64_t>;

  const ReservationOptions options_;
  ReservationOwner& owner_;
  std::atomic<std::uint32_t> pending_{0};
  // The thread that holds the engine's lock.
  ClockTime next_deadline_{};         ///< of a transaction one period after the last
  ClockTime release_{};               ///< of the last
  std::uint64_t release_period_ = 0;  ///< the busy period of that release
  Counter transactions_{0}, kept_{0}, broken_{0}, too_often_{0}, too_long_{0}, undeclared_{0};
  std::atomic<std::int64_t> largest_cost_ns_{0}, longest_response_ns_{0};
};

class Reservations {
 public:
  /// This many reserved transactions can preempt one another. With more reservations, each is one piece for
  /// the others.
  static constexpr std::size_t max_nested = 4;

  /// Admits the reservation, or says why it can not be kept. `piece`: the longest piece of other work that
  /// can not be preempted.
  Result<void> add(ReservationImpl& reservation, Nanoseconds piece);
  void remove(ReservationImpl& reservation) noexcept;
  std::vector<ReservationCounts> counts() const;

  std::size_t size() const noexcept { return admitted_.size(); }
  /// The largest cost of reserved transactions that may yet come in [from, to).
  Nanoseconds still_to_come(ClockTime from, ClockTime to) const noexcept;
  /// When work that would end at `end` ends if all reserved transactions that may come before come.
  ClockTime end_with_reserved(ClockTime now, ClockTime end) const noexcept;

  // ---- in the order of a transaction's life; without a reservation they do nothing
  /// The submitting thread. Gives a transaction without a deadline that of its reservation. Misuse where the
  /// reservation has another owner.
  static void submitted(ScheduledTransaction& transaction, const ReservationOwner& owner) noexcept;
  /// Sets whether it is reserved, and when it is due.
  void admitted(ScheduledTransaction& transaction) noexcept;
  /// A transaction that has spent more than its budget is no longer reserved: it goes on by its own terms.
  void enforce_budget(ScheduledTransaction& transaction, Nanoseconds spent) noexcept;
  /// It has this status, and its outcome is final but for `durable`.
  void ended(ScheduledTransaction& transaction, Status status) noexcept;
  /// Any thread. Its owner gets it back now.
  static void returned(const ScheduledTransaction& transaction) noexcept;

 private:
  std::vector<ReservationImpl*> admitted_;  ///< the engine's lock; changed under the mutex too
  mutable std::mutex counting_;
  std::uint32_t in_progress_ = 0;  ///< reserved transactions between admitted and ended
  std::uint64_t busy_period_ =
      1;  ///< number of the stretch of time with reserved work; another begins after it
};

}  // namespace rtstdb::scheduler
