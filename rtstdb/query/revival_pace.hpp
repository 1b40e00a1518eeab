#pragma once
// When the executor next tries to replace a lost device: at once after a device that had answered, and after
// longer and longer pauses when no device can be opened or each is lost before it answers.

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace rtstdb::query {

class RevivalPace {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds first_pause{100};
  static constexpr std::chrono::milliseconds longest_pause{10'000};

  void answered() noexcept { failures_ = 0; }
  /// The device is lost, or none could be opened.
  void failed(Time now) noexcept {
    next_ = now + pause();
    failures_ = std::min(failures_ + 1, max_counted);
  }
  bool may_try(Time now) const noexcept { return now >= next_; }
  std::chrono::milliseconds left(Time now) const noexcept {
    return std::max(std::chrono::ceil<std::chrono::milliseconds>(next_ - now), std::chrono::milliseconds(0));
  }

 private:
  static constexpr std::uint32_t max_counted = 16;
  std::chrono::milliseconds pause() const noexcept {
    if (failures_ == 0) return {};
    return std::min(first_pause * (1u << (failures_ - 1)), longest_pause);
  }
  std::uint32_t failures_ = 0;  // failures since it last answered
  Time next_{};
};

}  // namespace rtstdb::query
