#pragma once
// The newest value of something, handed from one thread to another without waiting: a triple buffer. The
// reader sees whole values only, never half of an old and half of a new one.

#include <array>
#include <atomic>
#include <cstdint>

namespace hil::io::can {

/// Threads: one writes, one reads; both are wait-free.
template <typename Value>
class LatestValue {
 public:
  /// Every copy starts as `initial`, so that a Value with memory of its own needs no allocation later.
  explicit LatestValue(const Value& initial) : buffers_{initial, initial, initial} {}

  /// Writer: the copy to fill. It holds some older value.
  Value& draft() noexcept { return buffers_[writing_]; }
  /// Writer: makes the draft the newest value.
  void publish() noexcept {
    const std::uint8_t before =
        shared_.exchange(static_cast<std::uint8_t>(writing_ | unread), std::memory_order_acq_rel);
    writing_ = before & index_mask;
  }

  /// Reader: the newest published value; stays valid and unchanged until the next call.
  const Value& newest() noexcept {
    if ((shared_.load(std::memory_order_relaxed) & unread) != 0) {
      reading_ = shared_.exchange(reading_, std::memory_order_acq_rel) & index_mask;
    }
    return buffers_[reading_];
  }

 private:
  static constexpr std::uint8_t unread = 4;
  static constexpr std::uint8_t index_mask = 3;

  std::array<Value, 3> buffers_;
  std::uint8_t writing_ = 0;
  std::atomic<std::uint8_t> shared_{1};
  std::uint8_t reading_ = 2;
};

}  // namespace hil::io::can
