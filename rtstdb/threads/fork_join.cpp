#include "rtstdb/threads/fork_join.hpp"

#include <pthread.h>
#include <sched.h>

#include "rtstdb/threads/futex.hpp"
#include "rtstdb/threads/signals_blocked.hpp"

namespace rtstdb::threads {

ForkJoin::ForkJoin(int priority) {
  const SignalsBlocked inherited_by_the_thread;
  thread_ = std::thread([this] { lend_a_hand(); });
  pthread_setname_np(thread_.native_handle(), "rtstdb second");
  // Set in any case, since a thread inherits its creator's policy. A refusal is reported for the calling
  // thread, which requests the same priority.
  const sched_param parameters{.sched_priority = priority};
  pthread_setschedparam(thread_.native_handle(), priority > 0 ? SCHED_FIFO : SCHED_OTHER, &parameters);
}

ForkJoin::~ForkJoin() {
  closing_.store(true);
  bell_.ring();
  thread_.join();
}

void ForkJoin::Loop::take_blocks(std::uint32_t hand) noexcept {
  for (std::uint32_t block = next.fetch_add(1, std::memory_order_relaxed); block < count;
       block = next.fetch_add(1, std::memory_order_relaxed))
    call(body, block, hand);
}

void ForkJoin::share(Loop&& loop) noexcept {
  if (loop.count < 2) return loop.take_blocks(0);
  open_.store(&loop);
  bell_.ring();
  loop.take_blocks(0);
  // Both threads store first and then load what the other stores, so either this sees the helper inside, or
  // the helper sees no loop.
  open_.store(nullptr);
  wait_for_the_other();
}

void ForkJoin::wait_for_the_other() noexcept {
  std::uint32_t seen = other_.load();
  while (seen != outside) {
    if (seen == waited_for || other_.compare_exchange_strong(seen, waited_for)) {
      futex_wait(other_, waited_for);
      seen = other_.load();
    }
  }
}

void ForkJoin::lend_a_hand() noexcept {
  while (true) {
    const std::uint32_t heard = bell_.heard();
    if (closing_.load()) return;
    other_.store(inside);
    if (Loop* loop = open_.load()) loop->take_blocks(1);
    if (other_.exchange(outside) == waited_for) futex_wake_all(&other_);
    bell_.sleep_unless_rung(heard);
  }
}

}  // namespace rtstdb::threads
