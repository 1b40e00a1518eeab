#include "rtstdb/transaction/ready_queue.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

#include <rtstdb/result.hpp>

#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

namespace {

auto urgency(const TransactionImpl& transaction) {
  if (transaction.reserved)
    return std::tuple(std::numeric_limits<int>::min(), transaction.due, transaction.arrival);
  return std::tuple(-int{transaction.terms().importance}, transaction.terms().deadline, transaction.arrival);
}

}  // namespace

bool ReadyQueue::less_urgent(const TransactionImpl* a, const TransactionImpl* b) noexcept {
  return urgency(*a) > urgency(*b);
}

void ReadyQueue::take_out(const TransactionImpl& transaction) noexcept {
  *std::find(heap_.begin(), heap_.end(), &transaction) = heap_.back();
  heap_.pop_back();
  std::make_heap(heap_.begin(), heap_.end(), less_urgent);
}

ReadyQueue::ReadyQueue(std::uint32_t capacity) : capacity_(capacity) {
  RTSTDB_ASSERT(capacity >= 1);
  heap_.reserve(capacity);
}

void ReadyQueue::push(TransactionImpl& transaction) noexcept {
  RTSTDB_ASSERT(!full());
  heap_.push_back(&transaction);
  std::push_heap(heap_.begin(), heap_.end(), less_urgent);
}

TransactionImpl* ReadyQueue::pop() noexcept {
  if (heap_.empty()) return nullptr;
  std::pop_heap(heap_.begin(), heap_.end(), less_urgent);
  TransactionImpl* const most_urgent = heap_.back();
  heap_.pop_back();
  return most_urgent;
}

TransactionImpl& ReadyQueue::shed(TransactionImpl& newcomer) noexcept {
  const auto least_urgent = [&](auto may_go) {
    TransactionImpl* found = may_go(newcomer) ? &newcomer : nullptr;
    for (TransactionImpl* waiting : heap_) {
      if (may_go(*waiting) && (found == nullptr || less_urgent(waiting, found))) found = waiting;
    }
    return found;
  };
  TransactionImpl* victim = least_urgent(
      [](const TransactionImpl& one) { return one.is(DeadlineClass::best_effort) && !one.reserved; });
  if (victim == nullptr && newcomer.reserved)
    victim = least_urgent([](const TransactionImpl& one) { return !one.reserved; });
  if (victim == nullptr || victim == &newcomer) return newcomer;
  take_out(*victim);
  return *victim;
}

bool ReadyQueue::comes_before(const TransactionImpl& newcomer, ClockTime deadline,
                              const TransactionImpl& other) noexcept {
  if (newcomer.reserved || other.reserved)
    return newcomer.reserved && (!other.reserved || newcomer.due < other.due);
  const auto importance = other.terms().importance;
  return importance < newcomer.terms().importance ||
         (importance == newcomer.terms().importance && deadline < other.terms().deadline);
}

Nanoseconds ReadyQueue::cost_before(const TransactionImpl& newcomer, ClockTime deadline) const noexcept {
  Nanoseconds sum{0};
  for (const TransactionImpl* waiting : heap_) {
    if (!comes_before(newcomer, deadline, *waiting)) sum += waiting->promised_cost;
  }
  return sum;
}

}  // namespace rtstdb::transaction
