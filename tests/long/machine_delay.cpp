#include "tests/long/machine_delay.hpp"

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>

namespace hil::long_test {
namespace {

std::int64_t now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

std::int64_t stolen_ns() {
  std::ifstream file("/proc/stat");
  std::string cpu;
  std::int64_t ticks[8] = {};
  file >> cpu;
  for (std::int64_t& one : ticks)
    file >> one;
  return ticks[7] * (1'000'000'000 / sysconf(_SC_CLK_TCK));
}

}  // namespace

MachineDelay::MachineDelay() : sleeper_([this] { measure_oversleep(); }) {}

MachineDelay::~MachineDelay() {
  done_ = true;
  sleeper_.join();
}

void MachineDelay::measure_oversleep() noexcept {
  constexpr std::int64_t period_ns = 1'000'000;
  std::int64_t wake_ns = now_ns();
  while (!done_) {
    wake_ns = std::max(wake_ns + period_ns, now_ns());
    const timespec wake{wake_ns / 1'000'000'000, wake_ns % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);
    overslept_ns_ += now_ns() - wake_ns;
  }
}

rtstdb::Nanoseconds MachineDelay::total() const {
  std::int64_t sum_ns = overslept_ns_ + stolen_ns();
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream file(task.path() / "schedstat");
    std::int64_t ran_ns = 0;
    std::int64_t waited_ns = 0;
    if (file >> ran_ns >> waited_ns) sum_ns += waited_ns;
  }
  return rtstdb::Nanoseconds(sum_ns);
}

}  // namespace hil::long_test
