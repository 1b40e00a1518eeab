#include "rtstdb/transaction/spin.hpp"

#include <sched.h>

#include <algorithm>

namespace rtstdb::transaction {

Nanoseconds spin_where_possible(Nanoseconds wanted) noexcept {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  const bool known = sched_getaffinity(0, sizeof cpus, &cpus) == 0;
  return known && CPU_COUNT(&cpus) < 2 ? Nanoseconds(0) : wanted;
}

bool is_realtime_thread() noexcept {
  const int policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  return policy == SCHED_FIFO || policy == SCHED_RR;
}

void Spin::pause() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

bool Spin::pays() noexcept {
  if (credit_ > 0) return true;
  if (++skipped_ < max_skipped) return false;
  skipped_ = 0;
  return true;
}

bool Spin::starves_others(ClockTime now) noexcept {
  if (now - policy_checked_at_ >= policy_check_interval) {
    policy_checked_at_ = now;
    realtime_ = is_realtime_thread();
  }
  return realtime_;
}

void Spin::note(bool found) noexcept {
  credit_ = found ? std::min(credit_ + gain, max_credit) : std::max(credit_ - 1, 0);
}

}  // namespace rtstdb::transaction
