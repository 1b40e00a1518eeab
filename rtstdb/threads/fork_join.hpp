#pragma once
// A helper thread for loops: it and the calling thread take blocks of the loop until none is left. If the
// helper does not get a processor, the caller executes all blocks; the caller waits for blocks that the
// helper has begun.
//
// Threads: one thread constructs the object and calls for_each_block; the body of the loop runs on it and on
// the helper.

#include <atomic>
#include <cstdint>
#include <thread>

#include "rtstdb/threads/event_count.hpp"

namespace rtstdb::threads {

class ForkJoin {
 public:
  /// `priority`: SCHED_FIFO priority of the helper, that of the calling thread; 0, or if it is refused:
  /// ordinary scheduling. Throws std::system_error if no thread can be created.
  explicit ForkJoin(int priority);
  ~ForkJoin();
  ForkJoin(const ForkJoin&) = delete;
  ForkJoin& operator=(const ForkJoin&) = delete;

  /// Number of threads. Index 0 is the caller's, 1 the helper.
  static constexpr std::uint32_t thread_count = 2;
  /// Calls body(block, thread_index) once for each block below `count` and returns when
  /// all calls have returned; their effects are visible then. The body must not throw. Neither allocates nor
  /// takes a lock.
  template <class Body>
  void for_each_block(std::uint32_t count, const Body& body) noexcept {
    run({.count = count,
         .body = &body,
         .call = [](const void* of, std::uint32_t block, std::uint32_t thread_index) {
           (*static_cast<const Body*>(of))(block, thread_index);
         }});
  }

 private:
  struct Loop {
    std::uint32_t count = 0;
    const void* body = nullptr;
    void (*call)(const void* body, std::uint32_t block, std::uint32_t thread_index) = nullptr;
    std::atomic<std::uint32_t> next{0};
    void take_blocks(std::uint32_t thread_index) noexcept;
  };
  void run(Loop&& loop) noexcept;
  void run_helper() noexcept;

  void wait_for_helper() noexcept;

  EventCount wake_up_;
  std::atomic<bool> closing_{false};
  std::atomic<Loop*> current_{nullptr};  // the loop that the helper may enter
  /// The helper: outside any loop, possibly inside one, or inside one while the caller sleeps until it
  /// leaves.
  enum HelperState : std::uint32_t { outside, inside, awaited };
  std::atomic<std::uint32_t> helper_{outside};
  std::thread thread_;
};

}  // namespace rtstdb::threads
