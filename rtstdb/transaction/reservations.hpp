#pragma once
// The reservations that stand: which are taken on, which transactions keep to theirs and when those are due, and how it
// went. What is promised is told in rtstdb/reservation.hpp.
//
// A transaction counts from its release, which is its deadline less the reservation's, or when it was submitted if that is
// later; and not less than a period after the release before, unless there was a moment since when nothing reserved was
// left to do, from which on all may be counted anew. So no length of time holds more than was looked at when the
// reservations were made, whatever the callers do. How often one may come in the long run is told by deadlines, so that one
// that is late once is not late ever after.
//
// Threads: admit_reservation and give_back by any, one at a time with the engine standing still; what transactions pass under the
// engine's lock; counts by any.

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/transaction/reserved_demand.hpp"

namespace rtstdb::transaction {

class Engine;
class Reservations;
class TransactionImpl;

class ReservationImpl final : public Reservation {
 public:
  ReservationImpl(ReservationOptions options, Engine& engine)
      : options_(std::move(options)), engine_(engine) {}
  /// Gives it back. Misuse while a transaction that names it is pending.
  ~ReservationImpl() override;
  ReservationImpl(const ReservationImpl&) = delete;
  ReservationImpl& operator=(const ReservationImpl&) = delete;

  const ReservationOptions& options() const noexcept override { return options_; }
  ReservationCounts counts() const override;

  const Engine& engine() const noexcept { return engine_; }

 private:
  friend class Reservations;
  using Counter = std::atomic<std::uint64_t>;

  const ReservationOptions options_;
  Engine& engine_;
  std::atomic<std::uint32_t> pending_{0};
  // Under the engine's lock.
  ClockTime next_deadline_{};      ///< of one that comes a period after the last
  ClockTime release_{};            ///< of the last
  std::uint64_t released_in_ = 0;  ///< the busy stretch that it fell into
  Counter transactions_{0}, kept_{0}, broken_{0}, too_often_{0}, too_long_{0}, not_as_declared_{0};
  std::atomic<std::int64_t> largest_cost_ns_{0}, longest_answer_ns_{0};
};

class Reservations {
 public:
  /// So many can run in one another's gaps; where there are more, each may wait for the whole of another.
  static constexpr std::size_t max_in_gaps = 4;

  /// Adds it, or says why not. `piece`: the longest one of other work that can not be interrupted.
  Result<void> admit_reservation(ReservationImpl& reservation, Nanoseconds piece, double share);
  void give_back(ReservationImpl& reservation) noexcept;
  std::vector<ReservationCounts> counts() const;

  std::size_t size() const noexcept { return taken_on_.size(); }
  /// The most that reserved transactions, not yet there, may cost between two times.
  Nanoseconds still_to_come(ClockTime from, ClockTime to) const noexcept;

  // ---- the way of a transaction that names one
  /// Its owner's thread. One without a deadline gets its reservation's.
  static void submitted(TransactionImpl& transaction) noexcept;
  /// Sets whether it is reserved, and when it is due.
  void admitted(TransactionImpl& transaction) noexcept;
  /// It goes on by its own terms.
  void has_taken_too_long(TransactionImpl& transaction) noexcept;
  /// What it did is known. The engine's lock.
  void ended(TransactionImpl& transaction, Status status) noexcept;
  /// It is about to be given back, which may be later, and on another thread.
  static void given_back(const TransactionImpl& transaction) noexcept;

 private:
  std::vector<ReservationImpl*> taken_on_;  // the engine's lock; changed under the mutex too
  mutable std::mutex counted_;
  std::uint32_t under_way_ = 0;     ///< reserved transactions, admitted and not ended
  std::uint64_t busy_stretch_ = 1;  ///< counts the moments without any
};

}  // namespace rtstdb::transaction
