#pragma once

#include <chrono>
#include <thread>

namespace hil::tests {

/// Waits until `condition` holds. False when it does not within the limit, which is longer than any machine
/// needs.
template <typename Condition>
bool eventually(const Condition& condition, std::chrono::milliseconds limit = std::chrono::seconds(60)) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace hil::tests
