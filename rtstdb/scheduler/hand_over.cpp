#include "rtstdb/scheduler/hand_over.hpp"

#include <utility>

namespace rtstdb::scheduler {

namespace {

HandOverLink closed_mark;

HandOverLink* reversed(HandOverLink* item) {
  HandOverLink* done = nullptr;
  while (item != nullptr) {
    HandOverLink* const older = std::exchange(item->next, done);
    done = item;
    item = older;
  }
  return done;
}

}  // namespace

bool HandOver::push(HandOverLink& item) noexcept {
  HandOverLink* newest = newest_.load(std::memory_order_acquire);
  do {
    if (newest == &closed_mark) return false;
    item.next = newest;
  } while (
      !newest_.compare_exchange_weak(newest, &item, std::memory_order_acq_rel, std::memory_order_acquire));
  return true;
}

HandOverLink* HandOver::take_all() noexcept {
  if (newest_.load(std::memory_order_relaxed) == nullptr) return nullptr;
  return reversed(newest_.exchange(nullptr, std::memory_order_acq_rel));
}

HandOverLink* HandOver::close() noexcept {
  return reversed(newest_.exchange(&closed_mark, std::memory_order_acq_rel));
}

}  // namespace rtstdb::scheduler
