#pragma once
// How long those who pass others wait for the gap that they pass them in, at the most: a chunk where elements cost what was thought; else
// what it takes to halt; and where single elements take long, they.

#include <algorithm>
#include <cmath>

#include <rtstdb/time.hpp>

namespace rtstdb::transaction {

class PreemptionLatency {
 public:
  void learn(Nanoseconds wait, ClockTime now) noexcept {
    const Nanoseconds before = longest(now);
    longest_ = std::max(before, std::min(wait, std::max(before + before / 2, Nanoseconds(least))));
    at_ = now;
  }
  /// Longer ones come once or twice a second. A single one, which may be the machine's, moves it by half; what does not come again is
  /// forgotten by half every second.
  Nanoseconds longest(ClockTime now) const noexcept {
    const double seconds = std::chrono::duration<double>(now - at_).count();
    return Nanoseconds(std::llround(static_cast<double>(longest_.count()) * std::exp2(-seconds)));
  }

 private:
  static constexpr Nanoseconds least{500'000};
  Nanoseconds longest_{0};
  ClockTime at_;
};

}  // namespace rtstdb::transaction
