#pragma once
// Waits for conditions that another thread makes true.

#include <chrono>
#include <thread>

namespace hil::test {

/// Polls `condition` until it is true. False: it is still false after five minutes, which is enough with a sanitizer too.
template <class Condition>
bool wait_until(Condition condition) {
  using Clock = std::chrono::steady_clock;
  for (const auto end = Clock::now() + std::chrono::minutes(5); !condition();) {
    if (Clock::now() >= end) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  return true;
}

}  // namespace hil::test
