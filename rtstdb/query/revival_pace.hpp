#pragma once
// How soon a lost device is tried again: at once after it had answered, and ever later where it does not come back, or
// is lost again before it has answered anything.

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace rtstdb::query {

class RevivalPace {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds first_pause{100};
  static constexpr std::chrono::milliseconds longest_pause{10'000};

  void answered() noexcept { in_vain_ = 0; }
  /// The device is lost, or could not be had.
  void failed(Time now) noexcept {
    next_ = now + pause();
    in_vain_ = std::min(in_vain_ + 1, max_counted);
  }
  bool may_try(Time now) const noexcept { return now >= next_; }
  std::chrono::milliseconds left(Time now) const noexcept {
    return std::max(std::chrono::ceil<std::chrono::milliseconds>(next_ - now), std::chrono::milliseconds(0));
  }

 private:
  static constexpr std::uint32_t max_counted = 16;
  std::chrono::milliseconds pause() const noexcept {
    if (in_vain_ == 0) return {};
    return std::min(first_pause * (1u << (in_vain_ - 1)), longest_pause);
  }
  std::uint32_t in_vain_ = 0;  // failures since it last answered
  Time next_{};
};

}  // namespace rtstdb::query
