#pragma once
// A lock-free list from any number of threads to one receiver. Each item carries its own link, so that push
// neither allocates nor fails for lack of space; an item is in one list at a time. An item that is pushed
// while the list is closed is either taken by the receiver or its push fails.

#include <atomic>

namespace rtstdb::scheduler {

struct HandOverLink {
  HandOverLink* next = nullptr;
};

class HandOver {
 public:
  /// Any thread. False: the list is closed, and the item stays the caller's.
  bool push(HandOverLink& item) noexcept;
  /// The receiver. Takes all items, linked in the order of their pushes; null: there are none.
  HandOverLink* take_all() noexcept;
  /// The receiver. Takes the last items and closes the list: every later push fails.
  HandOverLink* close() noexcept;

 private:
  std::atomic<HandOverLink*> newest_{nullptr};
};

}  // namespace rtstdb::scheduler
