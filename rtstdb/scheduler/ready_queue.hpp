#pragma once
// The admitted transactions that wait, in their order: reserved ones by when they are due; then higher
// importance, then earlier deadline, then earlier arrival.
//
// Threads: the thread that holds the engine's lock. Allocates in the constructor alone.

#include <cstdint>
#include <vector>

#include <rtstdb/time.hpp>

namespace rtstdb::scheduler {

class ScheduledTransaction;

class ReadyQueue {
 public:
  /// `capacity` >= 1.
  explicit ReadyQueue(std::uint32_t capacity);

  bool empty() const noexcept { return heap_.empty(); }
  bool full() const noexcept { return heap_.size() == capacity_; }
  /// Misuse when full.
  void push(ScheduledTransaction& transaction) noexcept;
  /// Takes the first one; null when empty.
  ScheduledTransaction* pop() noexcept;
  /// The first one, which stays; null when empty.
  ScheduledTransaction* first() const noexcept { return heap_.empty() ? nullptr : heap_.front(); }
  /// Whether a waiting transaction has precedence over this one.
  bool holds_before(const ScheduledTransaction& transaction) const noexcept {
    return !heap_.empty() && goes_before(*heap_.front(), transaction);
  }
  static bool goes_before(const ScheduledTransaction& a, const ScheduledTransaction& b) noexcept {
    return goes_after(&b, &a);
  }

  /// Takes the first one for which `accepts` is true; null when there is none.
  template <class Accepts>
  ScheduledTransaction* pop_first(Accepts accepts) noexcept {
    ScheduledTransaction* found = nullptr;
    for (ScheduledTransaction* waiting : heap_) {
      if (accepts(*waiting) && (found == nullptr || goes_after(found, waiting))) found = waiting;
    }
    if (found != nullptr) erase(*found);
    return found;
  }

  /// Chooses the transaction to be cancelled when a new one arrives at a full queue, and removes it from the
  /// queue: the last of the best-effort ones, the new one included; without one, and when the new one is
  /// reserved, the last that is not reserved; else the new one, which is in no queue.
  ScheduledTransaction& displace(ScheduledTransaction& arriving) noexcept;

  /// Whether a new transaction with this deadline would have precedence over `other`.
  static bool comes_before(const ScheduledTransaction& arriving, ClockTime deadline,
                           const ScheduledTransaction& other) noexcept;
  /// The sum of the promised costs of all that have precedence over a new one with this deadline.
  Nanoseconds cost_before(const ScheduledTransaction& arriving, ClockTime deadline) const noexcept;
  /// Visits all, in no order.
  template <class Each>
  void for_each(Each each) const noexcept {
    for (ScheduledTransaction* waiting : heap_)
      each(*waiting);
  }

 private:
  static bool goes_after(const ScheduledTransaction* a, const ScheduledTransaction* b) noexcept;
  void erase(const ScheduledTransaction& transaction) noexcept;

  std::vector<ScheduledTransaction*> heap_;  ///< a binary heap, the first one at its front
  std::uint32_t capacity_;
};

}  // namespace rtstdb::scheduler
