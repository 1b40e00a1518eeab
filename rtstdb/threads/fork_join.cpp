#include "rtstdb/threads/fork_join.hpp"

#include <pthread.h>
#include <sched.h>

#include "rtstdb/threads/signals_blocked.hpp"

namespace rtstdb::threads {

ForkJoin::ForkJoin(int priority) {
  const SignalsBlocked inherited_by_the_thread;
  thread_ = std::thread([this] { lend_a_hand(); });
  pthread_setname_np(thread_.native_handle(), "rtstdb second");
  // In any case: a thread inherits its creator's policy. The thread that waits for this one gets the same answer.
  const sched_param parameters{.sched_priority = priority};
  pthread_setschedparam(thread_.native_handle(), priority > 0 ? SCHED_FIFO : SCHED_OTHER, &parameters);
}

ForkJoin::~ForkJoin() {
  closing_.store(true);
  rung_.fetch_add(1);
  rung_.notify_one();
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
  rung_.fetch_add(1);
  rung_.notify_one();
  loop.take_blocks(0);
  // Either the other thread is seen inside here, or it finds no loop any more: both first store, then load what the other stores.
  open_.store(nullptr);
  inside_.wait(1);
}

void ForkJoin::lend_a_hand() noexcept {
  for (std::uint32_t heard = 0;;) {
    rung_.wait(heard);
    heard = rung_.load();
    if (closing_.load()) return;
    inside_.store(1);
    if (Loop* loop = open_.load()) loop->take_blocks(1);
    inside_.store(0);
    inside_.notify_one();
  }
}

}  // namespace rtstdb::threads
