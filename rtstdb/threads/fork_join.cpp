#include "rtstdb/threads/fork_join.hpp"

#include <pthread.h>
#include <sched.h>

#include "rtstdb/threads/futex.hpp"
#include "rtstdb/threads/signals_blocked.hpp"

namespace rtstdb::threads {

ForkJoin::ForkJoin(int priority) {
  const SignalsBlocked inherited_by_the_thread;
  thread_ = std::thread([this] { run_helper(); });
  pthread_setname_np(thread_.native_handle(), "rtstdb second");
  // Set in any case, since a thread inherits its creator's policy. A refusal is reported for the calling
  // thread, which requests the same priority.
  const sched_param parameters{.sched_priority = priority};
  pthread_setschedparam(thread_.native_handle(), priority > 0 ? SCHED_FIFO : SCHED_OTHER, &parameters);
}

ForkJoin::~ForkJoin() {
  closing_.store(true);
  wake_up_.notify();
  thread_.join();
}

void ForkJoin::Loop::take_blocks(std::uint32_t thread_index) noexcept {
  for (std::uint32_t block = next.fetch_add(1, std::memory_order_relaxed); block < count;
       block = next.fetch_add(1, std::memory_order_relaxed))
    call(body, block, thread_index);
}

void ForkJoin::run(Loop&& loop) noexcept {
  if (loop.count < 2) return loop.take_blocks(0);
  current_.store(&loop);
  wake_up_.notify();
  loop.take_blocks(0);
  // Both threads store first and then load what the other stores, so either this sees the helper inside, or
  // the helper sees no loop.
  current_.store(nullptr);
  wait_for_helper();
}

void ForkJoin::wait_for_helper() noexcept {
  std::uint32_t seen = helper_.load();
  while (seen != outside) {
    if (seen == awaited || helper_.compare_exchange_strong(seen, awaited)) {
      futex_wait(helper_, awaited);
      seen = helper_.load();
    }
  }
}

void ForkJoin::run_helper() noexcept {
  while (true) {
    const std::uint32_t count = wake_up_.count();
    if (closing_.load()) return;
    helper_.store(inside);
    if (Loop* loop = current_.load()) loop->take_blocks(1);
    if (helper_.exchange(outside) == awaited) futex_wake_all(&helper_);
    wake_up_.wait(count);
  }
}

}  // namespace rtstdb::threads
