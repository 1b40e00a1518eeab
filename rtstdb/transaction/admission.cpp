// The engine looks at what was handed over: what is admitted waits in the queue, all else is given back at once.

#include <functional>
#include <utility>

#include "rtstdb/transaction/engine.hpp"

namespace rtstdb::transaction {
namespace {

constexpr std::uint32_t refusals_before_one_is_let_in = 15;

}  // namespace

void Engine::receive() noexcept {
  received_at_ = bell_.load(std::memory_order_seq_cst);
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
  if (transaction.is_to_be_cancelled()) return finish_cancelled(transaction, CancelledBy::caller);
  if (!passes_admission(transaction, now)) return;
  if (queue_.full()) {
    TransactionImpl& victim = queue_.shed(transaction);
    finish_cancelled(victim, CancelledBy::full_queue);
    if (&victim == &transaction) return;
  }
  transaction.draft().admitted = now;
  queue_.push(transaction);
}

bool Engine::passes_admission(TransactionImpl& transaction, ClockTime now) noexcept {
  Outcome& outcome = transaction.draft();
  const ClockTime deadline = transaction.terms().deadline;
  const bool firm = transaction.is(DeadlineClass::firm);
  if (firm && now > deadline) {
    outcome.lateness = now - deadline;
    finish(transaction, Status::missed);
    return false;
  }
  if (clock_.is_virtual()) return true;
  const auto cost = costs_.predict(transaction.write_set(), transaction.requests());
  if (!cost) return true;
  outcome.predicted_cost = *cost;
  if (!firm || queue_.expected_end(now, transaction, deadline, *cost) <= deadline) {
    if (firm) refused_in_a_row_ = 0;
    return true;
  }
  if (refused_in_a_row_++ == refusals_before_one_is_let_in) {
    refused_in_a_row_ = 0;
    return true;
  }
  outcome.earliest_feasible = queue_.earliest_feasible(now, transaction, *cost);
  finish(transaction, Status::refused);
  return false;
}

}  // namespace rtstdb::transaction
