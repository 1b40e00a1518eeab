#pragma once
// The admitted transactions that wait, most urgent first: reserved ones by when they are due; then higher importance,
// then earlier deadline, then earlier arrival. Holds pointers only; allocates in the constructor alone. One thread.

#include <cstdint>
#include <vector>

#include <rtstdb/time.hpp>

namespace rtstdb::transaction {

class TransactionImpl;

class ReadyQueue {
 public:
  /// `capacity` >= 1.
  explicit ReadyQueue(std::uint32_t capacity);

  bool empty() const noexcept { return heap_.empty(); }
  bool full() const noexcept { return heap_.size() == capacity_; }
  /// Misuse when full.
  void push(TransactionImpl& transaction) noexcept;
  /// The most urgent one, or null.
  TransactionImpl* pop() noexcept;
  /// The most urgent one, which stays; null when empty.
  TransactionImpl* first() const noexcept { return heap_.empty() ? nullptr : heap_.front(); }
  /// Whether one that waits goes before this.
  bool holds_before(const TransactionImpl& transaction) const noexcept {
    return !heap_.empty() && goes_before(*heap_.front(), transaction);
  }
  static bool goes_before(const TransactionImpl& a, const TransactionImpl& b) noexcept {
    return less_urgent(&b, &a);
  }

  /// The most urgent one that `wanted` says yes to, or null.
  template <class Wanted>
  TransactionImpl* pop_first(Wanted wanted) noexcept {
    TransactionImpl* found = nullptr;
    for (TransactionImpl* waiting : heap_) {
      if (wanted(*waiting) && (found == nullptr || less_urgent(found, waiting))) found = waiting;
    }
    if (found != nullptr) take_out(*found);
    return found;
  }

  /// Who goes when there is no room for one more: the least urgent best-effort transaction, `newcomer` counted; else,
  /// where the newcomer is reserved, the least urgent that is not; else the newcomer. The one who goes is no longer in
  /// the queue.
  TransactionImpl& shed(TransactionImpl& newcomer) noexcept;

  /// Whether a transaction that comes now would go before `other`, with this deadline.
  static bool comes_before(const TransactionImpl& newcomer, ClockTime deadline,
                           const TransactionImpl& other) noexcept;
  /// What all that go before a newcomer with this deadline are promised to cost.
  Nanoseconds cost_before(const TransactionImpl& newcomer, ClockTime deadline) const noexcept;
  template <class Each>
  void for_each(Each each) const noexcept {
    for (TransactionImpl* waiting : heap_)
      each(*waiting);
  }

 private:
  static bool less_urgent(const TransactionImpl* a, const TransactionImpl* b) noexcept;
  void take_out(const TransactionImpl& transaction) noexcept;

  std::vector<TransactionImpl*> heap_;
  std::uint32_t capacity_;
};

}  // namespace rtstdb::transaction
