#include "rtstdb/scheduler/admission.hpp"

#include <algorithm>

namespace rtstdb::scheduler {
namespace {

/// After this many consecutive refusals one transaction is admitted without a promise. The second number holds for those
/// that would be in time at their mean cost.
constexpr std::uint32_t max_refusals = 15, max_refusals_of_likely = 3;

/// An owner that submits again with the deadline that a refusal names needs at least this long.
constexpr Nanoseconds resubmit_time{100'000};

}  // namespace

std::optional<Status> Admission::decide(ScheduledTransaction& transaction) noexcept {
  const ClockTime now = parts_.clock.now();
  transaction.arrival = arrivals_++;
  parts_.reservations.admitted(transaction);
  if (transaction.cancel_requested()) {
    transaction.draft().cancelled_by = CancelledBy::caller;
    return Status::cancelled;
  }
  if (read_only_ && transaction.writes()) {
    transaction.draft().refused_by = RefusedBy::read_only;
    return Status::refused;
  }
  const auto status = decide_by_cost(transaction, now);
  if (!status) transaction.draft().admitted = now;
  return status;
}

void Admission::predict(ScheduledTransaction& transaction) const noexcept {
  const auto cost = parts_.costs.predict(transaction.write_set(), transaction.requests());
  if (cost) {
    transaction.draft().predicted_cost = cost->mean;
    transaction.cost_known = true;
    transaction.promised_cost = cost->promised;
    // The queries whose answers may be partial can end after one chunk.
    transaction.required_cost = cost->required + std::min(cost->promised - cost->required, chunk_);
  }
  if (!transaction.reserved) return;
  const Nanoseconds budget = transaction.reservation()->options().budget;
  transaction.promised_cost = cost ? std::min(cost->promised, budget) : budget;
}

std::optional<Status> Admission::decide_by_cost(ScheduledTransaction& transaction, ClockTime now) noexcept {
  Outcome& outcome = transaction.draft();
  const ClockTime deadline = transaction.terms().deadline;
  const bool firm = transaction.is(DeadlineClass::firm);
  transaction.promised = false;
  transaction.cost_known = false;
  transaction.promised_cost = Nanoseconds(0);
  transaction.required_cost = Nanoseconds(0);
  if (firm && now > deadline) {
    transaction.note_lateness(now);
    return Status::missed;
  }
  if (parts_.clock.is_virtual()) return std::nullopt;
  predict(transaction);
  if (transaction.reserved) return std::nullopt;
  if (!transaction.cost_known) {
    // Whether the promises to those behind it can be kept is not known any more.
    for_each_lower_priority(transaction, deadline,
                            [](ScheduledTransaction& other) { other.promised = false; });
    return std::nullopt;
  }
  const ClockTime end = expected_end(now, transaction, deadline);
  const bool breaks_none = !firm || !first_broken(transaction, deadline);
  const bool in_time = end <= deadline;
  const Nanoseconds mean_cost = std::min(outcome.predicted_cost, transaction.required_cost);
  const bool is_likely = end - transaction.required_cost + mean_cost <= deadline;
  const std::uint32_t refusals = is_likely ? max_refusals_of_likely : max_refusals;
  if (breaks_none && (!firm || in_time || refused_in_a_row_ >= refusals)) {
    transaction.promised = firm && in_time && all_known_before(transaction, deadline);
    // What others take of its slack makes it later, so that more of the reserved transactions may come before it.
    const Nanoseconds reserved = firm ? parts_.reservations.still_to_come(end, deadline) : Nanoseconds(0);
    transaction.slack = std::max(deadline - end - reserved, Nanoseconds(0));
    for_each_lower_priority(transaction, deadline,
                            [&](ScheduledTransaction& other) { other.slack -= transaction.promised_cost; });
    if (firm) refused_in_a_row_ = 0;
    return std::nullopt;
  }
  if (breaks_none) ++refused_in_a_row_;
  outcome.refused_by = RefusedBy::admission;
  outcome.earliest_feasible = earliest_feasible(now, transaction);
  return Status::refused;
}

ClockTime Admission::expected_end(ClockTime now, const ScheduledTransaction& transaction,
                                  ClockTime deadline) const noexcept {
  const Nanoseconds before =
      remaining_before(now, transaction, deadline) + parts_.queue.cost_before(transaction, deadline);
  return parts_.reservations.end_with_reserved(now, now + before + transaction.required_cost);
}

bool Admission::all_known_before(const ScheduledTransaction& transaction, ClockTime deadline) const noexcept {
  const auto is_known = [&](const ScheduledTransaction& other) {
    return other.cost_known || other.reserved || ReadyQueue::comes_before(transaction, deadline, other);
  };
  bool known = true;
  parts_.queue.for_each([&](const ScheduledTransaction& other) { known = known && is_known(other); });
  for (const Run& run : parts_.preemption.runs().all())
    known = known && is_known(*run.transaction);
  return known;
}

Nanoseconds Admission::remaining_before(ClockTime now, const ScheduledTransaction& transaction,
                                        ClockTime deadline) const noexcept {
  Nanoseconds sum{0};
  const bool may_nest = parts_.preemption.may_nest(transaction);
  const bool divided = chunk_ > Nanoseconds(0);
  const Nanoseconds longest_chunk =
      divided ? std::max(chunk_, parts_.preemption.longest_latency(now)) : Nanoseconds(0);
  for (const Run& run : parts_.preemption.runs().all()) {
    const ScheduledTransaction& other = *run.transaction;
    const bool innermost = &run == &parts_.preemption.runs().innermost();
    const bool preempts = may_nest && ReadyQueue::comes_before(transaction, deadline, other);
    const Nanoseconds left_as_promised = other.promised_cost - run.time.total(now);
    // Of a run that takes longer than promised, or whose cost is not known, a chunk is left.
    const Nanoseconds chunk = left_as_promised > Nanoseconds(0) ? chunk_ : longest_chunk;
    const Nanoseconds left = std::max(left_as_promised, innermost ? chunk : Nanoseconds(0));
    if (preempts && divided) {
      sum += innermost ? std::min(left, longest_chunk) : Nanoseconds(0);
    } else {
      sum += left;
    }
  }
  return sum;
}

template <class Each>
void Admission::for_each_lower_priority(const ScheduledTransaction& transaction, ClockTime deadline,
                                        Each each) const noexcept {
  const auto visit = [&](ScheduledTransaction& other) {
    if (other.promised && ReadyQueue::comes_before(transaction, deadline, other)) each(other);
  };
  parts_.queue.for_each(visit);
  for (const Run& run : parts_.preemption.runs().all())
    visit(*run.transaction);
}

std::optional<ClockTime> Admission::first_broken(const ScheduledTransaction& transaction,
                                                 ClockTime deadline) const noexcept {
  std::optional<ClockTime> first;
  for_each_lower_priority(transaction, deadline, [&](const ScheduledTransaction& other) {
    const bool equal = other.terms().importance == transaction.terms().importance;
    if (!equal || other.slack >= transaction.promised_cost) return;
    first = std::min(first.value_or(ClockTime::max()), other.terms().deadline);
  });
  return first;
}

ClockTime Admission::earliest_feasible(ClockTime now,
                                       const ScheduledTransaction& transaction) const noexcept {
  // A later deadline lets more of the others go before, and breaks fewer promises: it is raised until it can be kept.
  const ClockTime resubmitted = now + std::max(resubmit_time, transaction.promised_cost / 8);
  ClockTime deadline = transaction.terms().deadline;
  while (true) {
    const ClockTime end = expected_end(resubmitted, transaction, deadline);
    if (end > deadline) {
      deadline = end;
    } else if (const auto broken = first_broken(transaction, deadline)) {
      deadline = *broken;
    } else {
      return deadline;
    }
  }
}

}  // namespace rtstdb::scheduler
