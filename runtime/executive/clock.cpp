#include "runtime/executive/clock.hpp"

#include <ctime>

namespace hil::executive {
namespace {
constexpr std::int64_t ns_per_s = 1'000'000'000;
}

std::int64_t MonotonicClock::now_ns() const noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * ns_per_s + now.tv_nsec;
}

void MonotonicClock::sleep_until(std::int64_t wake_ns) noexcept {
  const timespec wake{wake_ns / ns_per_s, wake_ns % ns_per_s};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);
}

}  // namespace hil::executive
