#include "rtstdb/scheduler/reservations.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/scheduler/scheduled_transaction.hpp"

namespace rtstdb::scheduler {
namespace {

constexpr Nanoseconds max_reservation_period{max_reservation_period_ns};

void count_one(std::atomic<std::uint64_t>& counter) noexcept {
  counter.fetch_add(1, std::memory_order_relaxed);
}

/// One thread writes.
void raise_to(std::atomic<std::int64_t>& largest, Nanoseconds value) noexcept {
  if (value.count() > largest.load(std::memory_order_relaxed))
    largest.store(value.count(), std::memory_order_relaxed);
}

/// To the nanosecond, so that a refused value never reads as the limit.
std::string in_ms(Nanoseconds time) {
  char text[40];
  std::snprintf(text, sizeof text, "%.15g ms", static_cast<double>(time.count()) / 1e6);
  return text;
}

std::string in_percent(double share) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g %%", share * 100.0);
  return text;
}

std::string described(const ReservationOptions& options) {
  return "reservation '" + options.name + "' (period " + in_ms(options.period) + ", deadline " +
         in_ms(options.deadline) + ", budget " + in_ms(options.budget) + ")";
}

Result<void> check(const ReservationOptions& options) {
  const auto refused = [&](const std::string& why) {
    return Error{ErrorCode::bad_input, described(options) + ": " + why};
  };
  if (options.period <= Nanoseconds(0) || options.period > max_reservation_period)
    return refused("the period must be above 0 and at most " + in_ms(max_reservation_period));
  if (options.deadline <= Nanoseconds(0) || options.deadline > max_reservation_period)
    return refused("the deadline must be above 0 and at most " + in_ms(max_reservation_period));
  if (options.budget <= Nanoseconds(0) || options.budget > options.deadline)
    return refused("the budget must be above 0 and at most the deadline");
  return {};
}

std::string describe(const Shortfall& shortfall, const std::vector<ReservationImpl*>& all, double share) {
  switch (shortfall.kind) {
    case Shortfall::Kind::utilization:
      return "all reservations together take " + in_percent(shortfall.utilization) +
             " of the time; less than " + in_percent(share) + " can be reserved";
    case Shortfall::Kind::undecided:
      return "all reservations together take " + in_percent(shortfall.utilization) +
             " of the time, which is too close to the limit of " + in_percent(share) + " to be checked";
    case Shortfall::Kind::within_length:
      break;
  }
  Nanoseconds sum = shortfall.piece;
  std::string parts;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (shortfall.demanded[k] == Nanoseconds(0)) continue;
    sum += shortfall.demanded[k];
    parts += "'" + all[k]->options().name + "' " + in_ms(shortfall.demanded[k]) + ", ";
  }
  return "within " + in_ms(shortfall.length) + " up to " + in_ms(sum) + " may be demanded (" + parts +
         "and " + in_ms(shortfall.piece) + " of other work that can not be preempted); " + in_percent(share) +
         " of it, which can be reserved, is " +
         in_ms(Nanoseconds(static_cast<std::int64_t>(share * static_cast<double>(shortfall.length.count()))));
}

}  // namespace

ReservationImpl::~ReservationImpl() {
  RTSTDB_REQUIRE(pending_.load(std::memory_order_acquire) == 0, "Reservation's destructor",
                 "a transaction that names the reservation is pending; wait for its outcome first");
  owner_.remove_reservation(*this);
}

ReservationCounts ReservationImpl::counts() const {
  const auto read = [](const Counter& counter) { return counter.load(std::memory_order_relaxed); };
  return {.options = options_,
          .transactions = read(transactions_),
          .kept = read(kept_),
          .broken = read(broken_),
          .too_often = read(too_often_),
          .too_long = read(too_long_),
          .undeclared = read(undeclared_),
          .largest_cost = Nanoseconds(largest_cost_ns_.load(std::memory_order_relaxed)),
          .longest_response = Nanoseconds(longest_response_ns_.load(std::memory_order_relaxed))};
}

Result<void> Reservations::add(ReservationImpl& reservation, Nanoseconds piece) {
  if (auto checked = check(reservation.options()); !checked) return checked;
  if (admitted_.size() == max_reservations) {
    return Error{ErrorCode::capacity, described(reservation.options()) + ": there are " +
                                          std::to_string(max_reservations) +
                                          " reservations already, which is the limit"};
  }
  std::vector<ReservationImpl*> all = admitted_;
  all.push_back(&reservation);
  const bool nested = all.size() <= max_nested;
  std::vector<Demand> demands;
  for (const ReservationImpl* one : all) {
    const ReservationOptions& options = one->options();
    const bool in_one_piece = options.writes_and_queries || !nested;
    demands.push_back({.period = options.period,
                       .deadline = options.deadline,
                       .budget = options.budget,
                       .piece = in_one_piece ? options.budget : std::min(piece, options.budget)});
  }
  if (const auto shortfall = first_shortfall(demands, piece, max_reserved_share)) {
    return Error{ErrorCode::capacity, described(reservation.options()) + " can not be kept: " +
                                          describe(*shortfall, all, max_reserved_share)};
  }
  const std::scoped_lock lock(counting_);
  admitted_ = std::move(all);
  return {};
}

void Reservations::remove(ReservationImpl& reservation) noexcept {
  const std::scoped_lock lock(counting_);
  std::erase(admitted_, &reservation);
}

std::vector<ReservationCounts> Reservations::counts() const {
  const std::scoped_lock lock(counting_);
  std::vector<ReservationCounts> all;
  for (const ReservationImpl* reservation : admitted_)
    all.push_back(reservation->counts());
  return all;
}

Nanoseconds Reservations::still_to_come(ClockTime from, ClockTime to) const noexcept {
  Nanoseconds sum{0};
  for (const ReservationImpl* reservation : admitted_) {
    const ReservationOptions& options = reservation->options();
    const ClockTime first = std::max(from, reservation->next_deadline_ - options.deadline);
    if (first < to) sum += ((to - first - Nanoseconds(1)) / options.period + 1) * options.budget;
  }
  return sum;
}

ClockTime Reservations::end_with_reserved(ClockTime now, ClockTime end) const noexcept {
  const Nanoseconds work = end - now;
  while (true) {
    const ClockTime later = now + work + still_to_come(now, end);
    if (later <= end) return end;
    end = later;
  }
}

void Reservations::submitted(ScheduledTransaction& transaction, const ReservationOwner& owner) noexcept {
  ReservationImpl* const reservation = transaction.reservation();
  if (reservation == nullptr) return;
  RTSTDB_REQUIRE(&reservation->owner_ == &owner, "Database::submit",
                 "Terms::reservation was made by another database");
  reservation->pending_.fetch_add(1, std::memory_order_relaxed);
  transaction.set_deadline_if_none(transaction.outcome().submitted + reservation->options_.deadline);
}

void Reservations::admitted(ScheduledTransaction& transaction) noexcept {
  transaction.reserved = false;
  ReservationImpl* const reservation = transaction.reservation();
  if (reservation == nullptr) return;
  const ReservationOptions& options = reservation->options_;
  if (!options.writes_and_queries && !transaction.write_set().empty() && !transaction.requests().empty())
    return count_one(reservation->undeclared_);
  const ClockTime submitted = transaction.outcome().submitted;
  // A deadline further off would make those after it seem to come too often.
  const ClockTime deadline =
      std::min(transaction.terms().deadline, submitted + options.deadline + options.period);
  if (deadline <= reservation->next_deadline_ - options.period / 2) return count_one(reservation->too_often_);
  reservation->next_deadline_ = std::max(deadline, reservation->next_deadline_) + options.period;
  ClockTime release = submitted;
  if (reservation->release_period_ == busy_period_)
    release = std::max(release, reservation->release_ + options.period);
  reservation->release_ = release;
  reservation->release_period_ = busy_period_;
  transaction.reserved = true;
  transaction.due = release + options.deadline;
  ++in_progress_;
}

void Reservations::enforce_budget(ScheduledTransaction& transaction, Nanoseconds spent) noexcept {
  if (!transaction.reserved || spent <= transaction.reservation()->options().budget) return;
  count_one(transaction.reservation()->too_long_);
  transaction.reserved = false;
  if (--in_progress_ == 0) ++busy_period_;
}

void Reservations::ended(ScheduledTransaction& transaction, Status status) noexcept {
  ReservationImpl* const reservation = transaction.reservation();
  if (reservation == nullptr) return;
  const Outcome& outcome = transaction.outcome();
  count_one(reservation->transactions_);
  const bool done = is_done(status);
  if (done) raise_to(reservation->largest_cost_ns_, outcome.actual_cost);
  if (transaction.reserved) {
    if (done && outcome.actual_cost > reservation->options_.budget) {
      count_one(reservation->too_long_);
    } else if (done || status == Status::missed) {
      const ClockTime ended = done ? outcome.published : transaction.terms().deadline + outcome.lateness;
      const bool in_time = ended <= transaction.due;
      // The deadline of a firm one may be shorter than the reserved one: then it is missed before it is due.
      if (done || !in_time) count_one(in_time ? reservation->kept_ : reservation->broken_);
      if (done) raise_to(reservation->longest_response_ns_, outcome.published - outcome.submitted);
    }
    if (--in_progress_ == 0) ++busy_period_;
  }
}

void Reservations::returned(const ScheduledTransaction& transaction) noexcept {
  if (ReservationImpl* const reservation = transaction.reservation())
    reservation->pending_.fetch_sub(1, std::memory_order_release);
}

}  // namespace rtstdb::scheduler
