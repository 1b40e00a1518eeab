#pragma once
// A ring of fixed records between one thread that must never wait and one that may. All memory is taken and
// touched when it is made. A full ring refuses the record and counts it: the writer goes on.

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace hil::executive {

template <typename Record>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<Record>);

 public:
  /// Holds at least `capacity` records.
  explicit SpscRing(std::size_t capacity) : records_(std::bit_ceil(capacity < 2 ? 2 : capacity)) {}

  std::size_t capacity() const noexcept { return records_.size(); }

  /// Writing thread. False: full, the record is lost and counted.
  bool push(const Record& record) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == records_.size()) {
      lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    records_[head & (records_.size() - 1)] = record;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Writing thread: whether at least half of the ring waits to be read.
  bool half_full() const noexcept {
    return (head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire)) * 2 >=
           records_.size();
  }

  /// Reading thread: hands over what was there when it was called, oldest first; not what arrives meanwhile.
  template <typename Reader>
  void drain(Reader&& read) {
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    for (std::uint64_t tail = tail_.load(std::memory_order_relaxed); tail != head; ++tail) {
      read(records_[tail & (records_.size() - 1)]);
      tail_.store(tail + 1, std::memory_order_release);
    }
  }

  /// Any thread.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  // What the writing thread changes and what the reading one does lie in cache lines of their own.
  alignas(64) std::atomic<std::uint64_t> head_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::vector<Record> records_;
  alignas(64) std::atomic<std::uint64_t> tail_{0};
};

}  // namespace hil::executive
