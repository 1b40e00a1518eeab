// The engine in the waits and gaps of a transaction that asks: others pass it there.

#include <utility>

#include "rtstdb/transaction/engine.hpp"
#include "rtstdb/transaction/late_answers.hpp"

namespace rtstdb::transaction {
namespace {

/// As its reservation says: no reserved one could write meanwhile, and others would only make that longer.
bool stays_in_one_piece(const TransactionImpl& transaction) noexcept {
  return transaction.reserved && !transaction.write_set().empty();
}

}  // namespace

void Engine::begin_wait() noexcept {
  if (log_ != nullptr) log_->hand_over();
  gap_awaited_since_.reset();
  // Pairs with ring: either the submitter sees the flag or its ring is heard here.
  waits_for_device_.store(true, std::memory_order_seq_cst);
  const bool work_there = bell_.heard() != received_at_ || !queue_.empty();
  waits_ = runner_.running().empty() ? nullptr : runner_.running().innermost().transaction;
  working_.unlock();
  if (work_there) relief_bell_.ring();
}

void Engine::end_wait() noexcept {
  device_is_done_.store(true, std::memory_order_relaxed);
  working_.lock();
  device_is_done_.store(false, std::memory_order_relaxed);
  waits_for_device_.store(false, std::memory_order_relaxed);
  gap_is_awaited_.store(false, std::memory_order_relaxed);
}

bool Engine::preemption_requested() noexcept {
  if (gap_is_awaited_.load(std::memory_order_relaxed)) return true;
  return waits_ != nullptr && (waits_->is_to_be_cancelled() ||
                               (waits_->is(DeadlineClass::firm) && clock_.now() > waits_->terms().deadline));
}

bool Engine::somebody_would_pass(const TransactionImpl& transaction) const noexcept {
  if (!queue_.holds_before(transaction) || stays_in_one_piece(transaction)) return false;
  bool some = has_to_give_way(transaction);
  queue_.for_each([&](const TransactionImpl& waiting) {
    some = some || (ReadyQueue::goes_before(waiting, transaction) && may_nest(waiting));
  });
  return some;
}

void Engine::on_outer_drained(Nanoseconds time) noexcept {
  if (clock_.is_virtual()) return;
  runner_.running().innermost().interrupted += time;
  Running* const outer = runner_.running().around();
  if (outer == nullptr) return;
  outer->device_time_while_preempted += time;
  preemption_latency_.learn(std::exchange(outer->awaited_for, Nanoseconds(0)) + time, clock_.now());
}

query::ExecutorCallbacks::Gap Engine::on_preemption_point() noexcept {
  receive();
  Running& running = runner_.running().innermost();
  const TransactionImpl& transaction = *running.transaction;
  if (transaction.is_to_be_cancelled()) return Gap::stop;
  enforce_budget(running);
  late_answers::note_gap(running, clock_);
  if (queue_.holds_before(transaction) && !stays_in_one_piece(transaction)) {
    running.preempted_at = clock_.now();
    running.awaited_for = *running.preempted_at - gap_awaited_since_.value_or(*running.preempted_at);
    const auto urgent = [&](const TransactionImpl& waiting) {
      return ReadyQueue::goes_before(waiting, transaction) && may_nest(waiting);
    };
    while (!has_to_give_way(transaction)) {
      TransactionImpl* const next = queue_.pop_first(urgent);
      if (next == nullptr) break;
      carry_out(*next);
      receive();
    }
    running.interrupted += clock_.now() - *running.preempted_at -
                           std::exchange(running.device_time_while_preempted, Nanoseconds(0));
    running.preempted_at.reset();
    running.must_restart = has_to_give_way(transaction);
    if (running.must_restart) return Gap::stop;
  }
  if (late_answers::are_enough(running, clock_)) return Gap::finish_in_flight;
  const bool in_vain = transaction.is(DeadlineClass::firm) && clock_.now() > transaction.terms().deadline;
  return in_vain ? Gap::stop : Gap::go_on;
}

void Engine::run_write_helper() noexcept {
  while (!closing_.load(std::memory_order_acquire)) {
    const std::uint32_t heard = relief_bell_.heard();
    if (waits_for_device_.load(std::memory_order_seq_cst)) {
      const std::lock_guard lock(working_);
      if (waits_for_device_.load(std::memory_order_relaxed)) carry_out_writes();
    }
    relief_bell_.sleep_unless_rung(heard);
  }
}

void Engine::carry_out_writes() noexcept {
  receive();
  fail_unmeetable();
  const auto only_writes = [this](const TransactionImpl& waiting) {
    return !waiting.write_set().empty() && waiting.requests().empty() && runner_.fits_beside(waiting);
  };
  while (!device_is_done_.load(std::memory_order_relaxed)) {
    TransactionImpl* const writer = queue_.pop_first(only_writes);
    if (writer == nullptr) break;
    carry_out_and_log(*writer);
  }
  if (log_ != nullptr) log_->hand_over();
  if (runner_.running().empty() || gap_is_awaited_.load(std::memory_order_relaxed) ||
      !somebody_would_pass(*runner_.running().innermost().transaction))
    return;
  gap_awaited_since_ = clock_.now();
  gap_is_awaited_.store(true, std::memory_order_relaxed);
}

}  // namespace rtstdb::transaction
