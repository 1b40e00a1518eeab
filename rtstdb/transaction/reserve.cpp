// The engine's side of reservations: what they are held to when they are made, and who gives way to a reserved
// transaction.
//
// A reserved one runs inside the gaps of others. Where it can not, since one of those has staged its writes, or reads what
// a commit would push out of the history, these begin anew behind it: nothing of theirs was published. Where there are
// several reservations a staged one always begins anew, or a second reserved one that writes would wait for a first that
// does not.

#include <algorithm>
#include <new>

#include "rtstdb/transaction/engine.hpp"

namespace rtstdb::transaction {

Result<std::unique_ptr<Reservation>> Engine::reserve(const ReservationOptions& options) {
  auto reservation = std::make_unique<ReservationImpl>(options, *this);
  Result<void> taken_on;
  call([&] {
    try {
      taken_on = admit_reservation(*reservation);
    } catch (const std::bad_alloc&) {
      taken_on =
          Error{ErrorCode::out_of_memory, "reservation '" + options.name + "' does not fit into memory"};
    }
  });
  if (!taken_on) return taken_on.error();
  return std::unique_ptr<Reservation>(std::move(reservation));
}

Result<void> Engine::admit_reservation(ReservationImpl& reservation) {
  // Time stands still in a virtual run: nothing takes any.
  if (clock_.is_virtual())
    return reservations_.admit_reservation(reservation, Nanoseconds(0), max_reserved_share_);
  if (chunk_ == Nanoseconds(0)) {
    return Error{ErrorCode::capacity,
                 "reservation '" + reservation.options().name +
                     "': chunk is 0, so that there is no end to what may go on before it"};
  }
  const scheduler::CostModel::Pieces pieces = costs_.longest_pieces();
  return reservations_.admit_reservation(reservation, std::max(chunk_ + pieces.structures, pieces.commit),
                                         max_reserved_share_);
}

void Engine::enforce_budget(const Running& running) noexcept {
  TransactionImpl& transaction = *running.transaction;
  if (!transaction.reserved) return;
  const Nanoseconds spent = clock_.now() - transaction.outcome().started - running.interrupted;
  if (spent > transaction.reservation()->options().budget) reservations_.has_taken_too_long(transaction);
}

bool Engine::may_nest(const TransactionImpl& waiting) const noexcept {
  const std::size_t kept_free =
      waiting.reserved ? 0 : std::min(reservations_.size(), Reservations::max_in_gaps);
  return runner_.running().depth() + kept_free <= query::max_nesting && runner_.fits_beside(waiting);
}

bool Engine::has_to_give_way(const TransactionImpl& innermost) const noexcept {
  const TransactionImpl* const first = queue_.first();
  if (innermost.reserved || first == nullptr || !first->reserved) return false;
  const bool may_be_in_anothers_way = reservations_.size() > 1 && runner_.running().one_is_staged();
  return may_be_in_anothers_way || !may_nest(*first);
}

void Engine::put_back(TransactionImpl& transaction) noexcept {
  Outcome& outcome = transaction.draft();
  ++outcome.restarts;
  restarts_.fetch_add(1, std::memory_order_relaxed);
  if (transaction.is_to_be_cancelled()) return finish_cancelled(transaction, CancelledBy::caller);
  transaction.slack -= clock_.now() - outcome.started;
  wait_in_queue(transaction);
}

ClockTime Engine::behind_reserved(ClockTime now, ClockTime end) const noexcept {
  const Nanoseconds others = end - now;
  while (true) {
    const ClockTime later = now + others + reservations_.still_to_come(now, end);
    if (later <= end) return end;
    end = later;
  }
}

}  // namespace rtstdb::transaction
