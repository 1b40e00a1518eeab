#pragma once
// A bounded FIFO of messages with values, each of a topic, from the tick to the thread that writes them.

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hil::recording {

/// Threads: one producer, one consumer; both are wait-free and allocate nothing.
class ValueRing {
 public:
  /// Holds at least `words` words; a message takes two and one for each value.
  explicit ValueRing(std::size_t words) : words_(std::bit_ceil(words)) {}

  /// Producer. `value(i)` is the i-th of `count` values. False: there is no space for it.
  template <typename Value>
  bool push(std::int64_t time_ns, std::uint32_t topic, std::size_t count, const Value& value) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) + head_words + count > words_.size()) return false;
    word(head) = static_cast<std::uint64_t>(time_ns);
    word(head + 1) = std::uint64_t{topic} << 32U | count;
    for (std::size_t i = 0; i < count; ++i)
      word(head + head_words + i) = std::bit_cast<std::uint64_t>(static_cast<double>(value(i)));
    head_.store(head + head_words + count, std::memory_order_release);
    return true;
  }

  // Consumer. All but is_empty need a message; they are about the oldest one.
  bool is_empty() const noexcept {
    return tail_.load(std::memory_order_relaxed) == head_.load(std::memory_order_acquire);
  }
  std::int64_t time_ns() const noexcept { return static_cast<std::int64_t>(word(tail())); }
  std::uint32_t topic() const noexcept { return static_cast<std::uint32_t>(word(tail() + 1) >> 32U); }
  std::size_t count() const noexcept { return static_cast<std::uint32_t>(word(tail() + 1)); }
  double value(std::size_t index) const noexcept {
    return std::bit_cast<double>(word(tail() + head_words + index));
  }
  void pop() noexcept { tail_.store(tail() + head_words + count(), std::memory_order_release); }

 private:
  static constexpr std::size_t head_words = 2;
  std::uint64_t tail() const noexcept { return tail_.load(std::memory_order_relaxed); }
  std::uint64_t& word(std::uint64_t place) noexcept { return words_[place & (words_.size() - 1)]; }
  std::uint64_t word(std::uint64_t place) const noexcept { return words_[place & (words_.size() - 1)]; }

  std::vector<std::uint64_t> words_;
  alignas(64) std::atomic<std::uint64_t> head_{0};
  alignas(64) std::atomic<std::uint64_t> tail_{0};
};

}  // namespace hil::recording
