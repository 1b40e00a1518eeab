#include "rtstdb/threads/futex.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <ctime>
#include <limits>

namespace rtstdb::threads {

static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t));
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

void futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t expected) noexcept {
  syscall(SYS_futex, &word, FUTEX_WAIT_PRIVATE, expected, nullptr, nullptr, 0);
}

void futex_wait_for(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
                    Nanoseconds timeout) noexcept {
  if (timeout <= Nanoseconds(0)) return;
  timespec limit{};
  limit.tv_sec = static_cast<std::time_t>(timeout.count() / 1'000'000'000);
  limit.tv_nsec = static_cast<long>(timeout.count() % 1'000'000'000);
  syscall(SYS_futex, &word, FUTEX_WAIT_PRIVATE, expected, &limit, nullptr, 0);
}

void futex_wake_all(const std::atomic<std::uint32_t>* word) noexcept {
  syscall(SYS_futex, word, FUTEX_WAKE_PRIVATE, std::numeric_limits<int>::max(), nullptr, nullptr, 0);
}

void FutexCell::wait_while(std::uint32_t value) noexcept {
  while (true) {
    std::uint32_t seen = word_.load(std::memory_order_acquire);
    if ((seen & ~sleeper) != value) return;
    if ((seen & sleeper) == 0 &&
        !word_.compare_exchange_weak(seen, value | sleeper, std::memory_order_acq_rel)) {
      continue;
    }
    futex_wait(word_, value | sleeper);
  }
}

}  // namespace rtstdb::threads
