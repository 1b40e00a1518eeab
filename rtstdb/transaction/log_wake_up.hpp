#pragma once
// How the log's thread sleeps and is woken: it sleeps until any notification, or, when its work may wait for
// more, until a time or notify_now(). A notification makes a system call only where it wakes the thread.
//
// The first thread that notifies a sleeper claims to wake it, and the others make no system call: on a busy
// machine the woken thread may run much later, and many commits notify it before that.
//
// Threads: one sleeps; any notifies. A notification neither allocates nor blocks.

#include <atomic>
#include <cstdint>

#include <rtstdb/time.hpp>

#include "rtstdb/threads/futex.hpp"

namespace rtstdb::transaction {

class LogWakeUp {
 public:
  struct Counts {
    std::uint32_t notifications = 0, immediate_notifications = 0;
  };
  /// The notifications so far. To be read before the thread looks for work.
  Counts counts() const noexcept {
    return {notifications_.load(std::memory_order_seq_cst),
            immediate_notifications_.load(std::memory_order_seq_cst)};
  }
  /// Until a notification, or not at all where one came since `seen`.
  void sleep(Counts seen) noexcept {
    begin_sleep(Sleep::until_notified);
    threads::futex_wait(notifications_, seen.notifications);
    end_sleep();
  }
  /// The same, at most for this long.
  void sleep(Counts seen, Nanoseconds at_most) noexcept {
    begin_sleep(Sleep::until_notified);
    threads::futex_wait_for(notifications_, seen.notifications, at_most);
    end_sleep();
  }
  /// Until notify_now(), at most for this long; not at all where it was called since `seen`.
  void sleep_until_notified_now(Counts seen, Nanoseconds at_most) noexcept {
    begin_sleep(Sleep::until_notified_now);
    threads::futex_wait_for(immediate_notifications_, seen.immediate_notifications, at_most);
    end_sleep();
  }

  void notify() noexcept {
    // Pairs with begin_sleep: either the sleeper sees the notification, or this thread sees the sleeper.
    notifications_.fetch_add(1, std::memory_order_seq_cst);
    wake_from(Sleep::until_notified, notifications_);
  }
  void notify_now() noexcept {
    immediate_notifications_.fetch_add(1, std::memory_order_seq_cst);
    notify();
    wake_from(Sleep::until_notified_now, immediate_notifications_);
  }

 private:
  enum class Sleep : std::uint8_t { none, until_notified, until_notified_now };

  void begin_sleep(Sleep kind) noexcept { sleeps_.store(kind, std::memory_order_seq_cst); }
  void end_sleep() noexcept { sleeps_.store(Sleep::none, std::memory_order_relaxed); }

  void wake_from(Sleep kind, std::atomic<std::uint32_t>& notifications) noexcept {
    Sleep seen = kind;
    if (sleeps_.load(std::memory_order_seq_cst) != kind ||
        !sleeps_.compare_exchange_strong(seen, Sleep::none, std::memory_order_seq_cst))
      return;
    // The sleeper may read this notification as seen and sleep after the wake-up: another count keeps it
    // from sleeping.
    notifications.fetch_add(1, std::memory_order_seq_cst);
    threads::futex_wake_all(&notifications);
  }

  std::atomic<std::uint32_t> notifications_{0}, immediate_notifications_{0};
  std::atomic<Sleep> sleeps_{Sleep::none};
};

}  // namespace rtstdb::transaction
