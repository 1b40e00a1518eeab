// The engine looks at what was handed over: what is admitted waits in the queue, all else is given back at once.

#include <algorithm>
#include <functional>
#include <utility>

#include "rtstdb/transaction/engine.hpp"

namespace rtstdb::transaction {
namespace {

/// Then one is let in, to which nothing is promised, and its cost is seen. Sooner where it is refused for what such ones have cost at
/// times, and would be in time at the usual cost.
constexpr std::uint32_t refusals_in_a_row = 15, refusals_of_likely_ones_in_a_row = 3;

/// An owner who is refused and asks for the deadline that was named needs so long for it, at least.
constexpr Nanoseconds to_ask_again{100'000};

}  // namespace

void Engine::receive() noexcept {
  received_at_ = bell_.heard();
  HandOverLink* transactions = submitted_.take_all();
  while (transactions != nullptr) {
    HandOverLink* const next = transactions->next;
    admit(static_cast<TransactionImpl&>(*transactions));
    transactions = next;
  }
  const std::uint32_t asked = cancels_asked_.load(std::memory_order_acquire);
  if (std::exchange(cancels_seen_, asked) != asked) drop_cancelled();
}

void Engine::drop_cancelled() noexcept {
  while (TransactionImpl* const waiting = queue_.pop_first(std::mem_fn(&TransactionImpl::is_to_be_cancelled)))
    finish_cancelled(*waiting, CancelledBy::caller);
}

void Engine::admit(TransactionImpl& transaction) noexcept {
  const ClockTime now = clock_.now();
  transaction.arrival = arrivals_++;
  reservations_.admitted(transaction);
  if (transaction.is_to_be_cancelled()) return finish_cancelled(transaction, CancelledBy::caller);
  if (is_past_ && !transaction.write_set().empty()) {
    transaction.draft().refused_by = RefusedBy::read_only;
    return finish(transaction, Status::refused);
  }
  if (!passes_admission(transaction, now)) return;
  transaction.draft().admitted = now;
  wait_in_queue(transaction);
}

void Engine::wait_in_queue(TransactionImpl& transaction) noexcept {
  if (queue_.full()) {
    TransactionImpl& victim = queue_.shed(transaction);
    finish_cancelled(victim, CancelledBy::full_queue);
    if (&victim == &transaction) return;
  }
  queue_.push(transaction);
}

bool Engine::passes_admission(TransactionImpl& transaction, ClockTime now) noexcept {
  Outcome& outcome = transaction.draft();
  const ClockTime deadline = transaction.terms().deadline;
  const bool firm = transaction.is(DeadlineClass::firm);
  transaction.promised = false;
  transaction.cost_known = false;
  transaction.promised_cost = Nanoseconds(0);
  transaction.needed_cost = Nanoseconds(0);
  if (firm && now > deadline) {
    transaction.note_late(now);
    finish(transaction, Status::missed);
    return false;
  }
  if (clock_.is_virtual()) return true;
  const auto cost = costs_.predict(transaction.write_set(), transaction.requests());
  if (cost) {
    outcome.predicted_cost = cost->mean;
    transaction.cost_known = true;
    transaction.promised_cost = cost->promised;
    transaction.needed_cost = cost->required + std::min(cost->promised - cost->required, chunk_);
  }
  if (transaction.reserved) {
    const Nanoseconds budget = transaction.reservation()->options().budget;
    transaction.promised_cost = cost ? std::min(cost->promised, budget) : budget;
    return true;
  }
  if (!cost) {
    // Nobody knows whether they are kept behind it.
    for_each_lower_priority(transaction, deadline, [](TransactionImpl& other) { other.promised = false; });
    return true;
  }
  const ClockTime end = expected_end(now, transaction, deadline);
  const bool breaks_none = !firm || !first_broken(transaction, deadline);
  const bool in_time = end <= deadline;
  const Nanoseconds usual_cost = std::min(outcome.predicted_cost, transaction.needed_cost);
  const bool is_likely = end - transaction.needed_cost + usual_cost <= deadline;
  const std::uint32_t refusals = is_likely ? refusals_of_likely_ones_in_a_row : refusals_in_a_row;
  if (breaks_none && (!firm || in_time || refused_in_a_row_ >= refusals)) {
    transaction.promised = firm && in_time && all_known_before(transaction, deadline);
    // What others may still take from it makes it later, and lets more of the reserved ones in.
    const Nanoseconds reserved = firm ? reservations_.still_to_come(end, deadline) : Nanoseconds(0);
    transaction.slack = std::max(deadline - end - reserved, Nanoseconds(0));
    take_from_slack(transaction);
    if (firm) refused_in_a_row_ = 0;
    return true;
  }
  if (breaks_none) ++refused_in_a_row_;
  outcome.refused_by = RefusedBy::admission;
  outcome.earliest_feasible = earliest_feasible(now, transaction);
  finish(transaction, Status::refused);
  return false;
}

ClockTime Engine::expected_end(ClockTime now, const TransactionImpl& transaction,
                               ClockTime deadline) const noexcept {
  return behind_reserved(now, now + rest_before(now, transaction, deadline) +
                                  queue_.cost_before(transaction, deadline) + transaction.needed_cost);
}

bool Engine::all_known_before(const TransactionImpl& transaction, ClockTime deadline) const noexcept {
  bool known = true;
  const auto look = [&](const TransactionImpl& other) {
    known = known &&
            (other.cost_known || other.reserved || ReadyQueue::comes_before(transaction, deadline, other));
  };
  queue_.for_each(look);
  for (const Running& running : runner_.running().all())
    look(*running.transaction);
  return known;
}

Nanoseconds Engine::rest_before(ClockTime now, const TransactionImpl& transaction,
                                ClockTime deadline) const noexcept {
  Nanoseconds sum{0};
  const bool may_nest_here = may_nest(transaction);
  const Nanoseconds longest_chunk =
      chunk_ > Nanoseconds(0) ? std::max(chunk_, preemption_latency_.longest(now)) : Nanoseconds(0);
  for (const Running& running : runner_.running().all()) {
    const TransactionImpl& other = *running.transaction;
    const bool innermost = &running == &runner_.running().all().back();
    const bool passed = may_nest_here && ReadyQueue::comes_before(transaction, deadline, other);
    const Nanoseconds spent =
        running.preempted_at.value_or(now) - other.outcome().started - running.interrupted;
    // Of one that takes longer than was thought, or of which nothing is known, a chunk is left.
    const Nanoseconds as_promised = running.transaction->promised_cost - spent;
    const Nanoseconds chunk = as_promised > Nanoseconds(0) ? chunk_ : longest_chunk;
    const Nanoseconds left = std::max(as_promised, innermost ? chunk : Nanoseconds(0));
    if (passed && chunk_ > Nanoseconds(0)) {
      sum += innermost ? std::min(left, longest_chunk) : Nanoseconds(0);
    } else {
      sum += left;
    }
  }
  return sum;
}

template <class Each>
void Engine::for_each_lower_priority(const TransactionImpl& transaction, ClockTime deadline,
                                     Each each) noexcept {
  const auto look = [&](TransactionImpl& other) {
    if (other.promised && ReadyQueue::comes_before(transaction, deadline, other)) each(other);
  };
  queue_.for_each(look);
  for (const Running& running : runner_.running().all()) {
    look(*running.transaction);
  }
}

std::optional<ClockTime> Engine::first_broken(const TransactionImpl& transaction,
                                              ClockTime deadline) noexcept {
  std::optional<ClockTime> first;
  for_each_lower_priority(transaction, deadline, [&](const TransactionImpl& other) {
    const bool equal = other.terms().importance == transaction.terms().importance;
    if (!equal || other.slack >= transaction.promised_cost) return;
    first = std::min(first.value_or(ClockTime::max()), other.terms().deadline);
  });
  return first;
}

void Engine::take_from_slack(const TransactionImpl& transaction) noexcept {
  for_each_lower_priority(transaction, transaction.terms().deadline,
                          [&](TransactionImpl& other) { other.slack -= transaction.promised_cost; });
}

ClockTime Engine::earliest_feasible(ClockTime now, const TransactionImpl& transaction) noexcept {
  // A later deadline lets more of the others go before, and breaks fewer promises: raise it until it stands.
  const ClockTime asked_again = now + std::max(to_ask_again, transaction.promised_cost / 8);
  ClockTime deadline = transaction.terms().deadline;
  while (true) {
    const ClockTime end = expected_end(asked_again, transaction, deadline);
    if (end > deadline) {
      deadline = end;
    } else if (const auto broken = first_broken(transaction, deadline)) {
      deadline = *broken;
    } else {
      return deadline;
    }
  }
}

}  // namespace rtstdb::transaction
