#pragma once
// A second thread for loops of one's own: both take blocks of the loop until none is left. Where the other thread does not come to
// run, the caller does it all; what the other has begun is waited for.
//
// Threads: one, which makes it too; the loop's body is called on it and on the other.

#include <atomic>
#include <cstdint>
#include <thread>

#include "rtstdb/threads/bell.hpp"

namespace rtstdb::threads {

class ForkJoin {
 public:
  /// `priority`: SCHED_FIFO, as of the thread that waits for this one; 0, or where it is refused: ordinary. Throws
  /// std::system_error when there can be no thread.
  explicit ForkJoin(int priority);
  ~ForkJoin();
  ForkJoin(const ForkJoin&) = delete;
  ForkJoin& operator=(const ForkJoin&) = delete;

  /// Who calls the body: 0 is the caller's own thread, 1 the other.
  static constexpr std::uint32_t hands = 2;
  /// Calls body(block, hand) once for each block below `count` and returns when all calls have; what they did is seen then. The
  /// body does not throw. Neither allocates nor takes a lock.
  template <class Body>
  void each(std::uint32_t count, const Body& body) noexcept {
    share(
        {.count = count, .body = &body, .call = [](const void* of, std::uint32_t block, std::uint32_t hand) {
           (*static_cast<const Body*>(of))(block, hand);
         }});
  }

 private:
  struct Loop {
    std::uint32_t count = 0;
    const void* body = nullptr;
    void (*call)(const void* body, std::uint32_t block, std::uint32_t hand) = nullptr;
    std::atomic<std::uint32_t> next{0};
    void take_blocks(std::uint32_t hand) noexcept;
  };
  void share(Loop&& loop) noexcept;
  void lend_a_hand() noexcept;

  void wait_for_the_other() noexcept;

  Bell bell_;
  std::atomic<bool> closing_{false};
  std::atomic<Loop*> open_{nullptr};  // takes in who comes
  /// Where the other thread is: at no loop, at one perhaps, or at one that the caller sleeps for.
  enum Other : std::uint32_t { outside, inside, waited_for };
  std::atomic<std::uint32_t> other_{outside};
  std::thread thread_;
};

}  // namespace rtstdb::threads
