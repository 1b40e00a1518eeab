#pragma once
// From any number of threads to one, without lock or allocation: each item carries its own link, so there is
// always room, and an item is handed over at most once at a time. Closing is airtight: an item is either
// taken by the receiver or its push fails.

#include <atomic>

namespace rtstdb::transaction {

struct HandOverLink {
  HandOverLink* next = nullptr;
};

class HandOver {
 public:
  /// Any thread. False: closed, the item is the caller's still.
  bool push(HandOverLink& item) noexcept;
  /// Receiver. All items, linked in the order of their pushes; null when there are none.
  HandOverLink* take_all() noexcept;
  /// Receiver. The last items; every later push fails.
  HandOverLink* close() noexcept;

 private:
  std::atomic<HandOverLink*> newest_{nullptr};
};

}  // namespace rtstdb::transaction
