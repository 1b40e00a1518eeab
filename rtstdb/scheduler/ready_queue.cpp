#include "rtstdb/scheduler/ready_queue.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

#include <rtstdb/result.hpp>

#include "rtstdb/scheduler/scheduled_transaction.hpp"

namespace rtstdb::scheduler {

namespace {

/// Smaller goes first.
auto rank(const ScheduledTransaction& transaction) {
  if (transaction.reserved)
    return std::tuple(std::numeric_limits<int>::min(), transaction.due, transaction.arrival);
  return std::tuple(-int{transaction.terms().importance}, transaction.terms().deadline, transaction.arrival);
}

}  // namespace

bool ReadyQueue::goes_after(const ScheduledTransaction* a, const ScheduledTransaction* b) noexcept {
  return rank(*a) > rank(*b);
}

void ReadyQueue::erase(const ScheduledTransaction& transaction) noexcept {
  *std::find(heap_.begin(), heap_.end(), &transaction) = heap_.back();
  heap_.pop_back();
  std::make_heap(heap_.begin(), heap_.end(), goes_after);
}

ReadyQueue::ReadyQueue(std::uint32_t capacity) : capacity_(capacity) {
  RTSTDB_ASSERT(capacity >= 1, "the capacity is 0");
  heap_.reserve(capacity);
}

void ReadyQueue::push(ScheduledTransaction& transaction) noexcept {
  RTSTDB_ASSERT(!full(), "the queue is full");
  heap_.push_back(&transaction);
  std::push_heap(heap_.begin(), heap_.end(), goes_after);
}

ScheduledTransaction* ReadyQueue::pop() noexcept {
  if (heap_.empty()) return nullptr;
  std::pop_heap(heap_.begin(), heap_.end(), goes_after);
  ScheduledTransaction* const first = heap_.back();
  heap_.pop_back();
  return first;
}

ScheduledTransaction& ReadyQueue::displace(ScheduledTransaction& arriving) noexcept {
  const auto last_of = [&](auto may_go) {
    ScheduledTransaction* found = may_go(arriving) ? &arriving : nullptr;
    for (ScheduledTransaction* waiting : heap_) {
      if (may_go(*waiting) && (found == nullptr || goes_after(waiting, found))) found = waiting;
    }
    return found;
  };
  ScheduledTransaction* displaced = last_of(
      [](const ScheduledTransaction& one) { return one.is(DeadlineClass::best_effort) && !one.reserved; });
  if (displaced == nullptr && arriving.reserved)
    displaced = last_of([](const ScheduledTransaction& one) { return !one.reserved; });
  if (displaced == nullptr || displaced == &arriving) return arriving;
  erase(*displaced);
  return *displaced;
}

bool ReadyQueue::comes_before(const ScheduledTransaction& arriving, ClockTime deadline,
                              const ScheduledTransaction& other) noexcept {
  if (arriving.reserved || other.reserved)
    return arriving.reserved && (!other.reserved || arriving.due < other.due);
  const auto importance = other.terms().importance;
  return importance < arriving.terms().importance ||
         (importance == arriving.terms().importance && deadline < other.terms().deadline);
}

Nanoseconds ReadyQueue::cost_before(const ScheduledTransaction& arriving, ClockTime deadline) const noexcept {
  Nanoseconds sum{0};
  for (const ScheduledTransaction* waiting : heap_) {
    if (!comes_before(arriving, deadline, *waiting)) sum += waiting->promised_cost;
  }
  return sum;
}

}  // namespace rtstdb::scheduler
