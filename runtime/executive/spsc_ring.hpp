#pragma once
// A single-producer single-consumer ring of fixed-size records, whose producer never waits. All memory is
// allocated and touched at construction. A full ring drops the record and counts it.

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

  /// Producer. False: the ring is full; the record is dropped and counted.
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

  /// Producer: whether the ring is at least half full.
  bool half_full() const noexcept {
    return (head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire)) * 2 >=
           records_.size();
  }

  /// Consumer: passes on the records that were available at the call, oldest first.
  template <typename Reader>
  void drain(Reader&& read) {
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    for (std::uint64_t tail = tail_.load(std::memory_order_relaxed); tail != head; ++tail) {
      read(records_[tail & (records_.size() - 1)]);
      tail_.store(tail + 1, std::memory_order_release);
    }
  }

  /// Consumer: the oldest record, valid until pop; null: there is none.
  const Record* front() const noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    return tail == head_.load(std::memory_order_acquire) ? nullptr : &records_[tail & (records_.size() - 1)];
  }
  /// Consumer: removes the oldest record, which exists.
  void pop() noexcept { tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  /// Any thread.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  // Producer and consumer state lie in separate cache lines.
  alignas(64) std::atomic<std::uint64_t> head_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::vector<Record> records_;
  alignas(64) std::atomic<std::uint64_t> tail_{0};
};

}  // namespace hil::executive
