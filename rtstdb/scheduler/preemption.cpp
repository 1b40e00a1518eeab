#include "rtstdb/scheduler/preemption.hpp"

#include <algorithm>
#include <utility>

namespace rtstdb::scheduler {
namespace {

/// A reservation with writes is declared as one piece: no other reserved transaction could write at its
/// preemption points, and the others would only make the piece longer.
bool is_one_piece(const ScheduledTransaction& transaction) noexcept {
  return transaction.reserved && transaction.writes();
}

}  // namespace

bool Preemption::can_execute(const ScheduledTransaction& transaction) const noexcept {
  if (!transaction.writes()) return true;
  return !runs_.any_staged() && std::ranges::all_of(runs_.all(), [&](const Run& run) {
    return !run.reading || store_.keeps_after(*run.reading, transaction.write_set());
  });
}

bool Preemption::may_nest(const ScheduledTransaction& waiting) const noexcept {
  const std::size_t kept_free =
      waiting.reserved ? 0 : std::min(reservations_.size(), Reservations::max_nested);
  return runs_.depth() + kept_free <= query::max_nesting && can_execute(waiting);
}

bool Preemption::must_restart(const ScheduledTransaction& innermost) const noexcept {
  const ScheduledTransaction* const first = queue_.first();
  if (innermost.reserved || first == nullptr || !first->reserved) return false;
  // With several reservations a second one that writes would wait for a first that does not.
  const bool may_block_another = reservations_.size() > 1 && runs_.any_staged();
  return may_block_another || !may_nest(*first);
}

bool Preemption::is_due() const noexcept {
  const ScheduledTransaction& innermost = *runs_.innermost().transaction;
  return queue_.holds_before(innermost) && !is_one_piece(innermost);
}

void Preemption::suspend() noexcept {
  Run& run = runs_.innermost();
  const ClockTime now = clock_.now();
  run.time.stop(now);
  run.preempted_at = now;
  run.point_requested_for = now - requested_at_.value_or(now);
}

ScheduledTransaction* Preemption::next() noexcept {
  const ScheduledTransaction& innermost = *runs_.innermost().transaction;
  if (must_restart(innermost)) return nullptr;
  return queue_.pop_first([&](const ScheduledTransaction& waiting) {
    return ReadyQueue::goes_before(waiting, innermost) && may_nest(waiting);
  });
}

void Preemption::resume() noexcept {
  Run& run = runs_.innermost();
  run.preempted_at.reset();
  run.time.start(clock_.now());
  run.must_restart = must_restart(*run.transaction);
}

void Preemption::begin_drain() noexcept {
  if (clock_.is_virtual()) return;
  drain_began_ = clock_.now();
  runs_.innermost().time.stop(drain_began_);
  if (Run* const preempted = runs_.preempted_by_innermost()) preempted->time.start(drain_began_);
}

void Preemption::end_drain() noexcept {
  if (clock_.is_virtual()) return;
  const ClockTime now = clock_.now();
  runs_.innermost().time.start(now);
  Run* const preempted = runs_.preempted_by_innermost();
  if (preempted == nullptr) return;
  preempted->time.stop(now);
  latency_.update(std::exchange(preempted->point_requested_for, Nanoseconds(0)) + (now - drain_began_), now);
}

void Preemption::begin_wait() noexcept {
  requested_at_.reset();
  waiting_for_device_ = runs_.empty() ? nullptr : runs_.innermost().transaction;
}

void Preemption::end_wait() noexcept {
  requested_.store(false, std::memory_order_relaxed);
}

void Preemption::request_if_useful() noexcept {
  if (runs_.empty() || requested_.load(std::memory_order_relaxed) || !is_due()) return;
  const ScheduledTransaction& innermost = *runs_.innermost().transaction;
  bool useful = must_restart(innermost);
  queue_.for_each([&](const ScheduledTransaction& waiting) {
    useful = useful || (ReadyQueue::goes_before(waiting, innermost) && may_nest(waiting));
  });
  if (!useful) return;
  requested_at_ = clock_.now();
  requested_.store(true, std::memory_order_relaxed);
}

bool Preemption::requested() const noexcept {
  if (requested_.load(std::memory_order_relaxed)) return true;
  if (waiting_for_device_ == nullptr) return false;
  const ScheduledTransaction& waiting = *waiting_for_device_;
  return waiting.cancel_requested() ||
         (waiting.is(DeadlineClass::firm) && clock_.now() > waiting.terms().deadline);
}

}  // namespace rtstdb::scheduler
