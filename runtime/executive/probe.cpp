#include "runtime/executive/probe.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <ctime>

#include "runtime/executive/clock.hpp"

namespace hil::executive {
namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;

std::int64_t used_ns(clockid_t clock) noexcept {
  timespec used{};
  clock_gettime(clock, &used);
  return static_cast<std::int64_t>(used.tv_sec) * ns_per_s + used.tv_nsec;
}

}  // namespace

SystemProbe::SystemProbe() noexcept
    : stat_file_(open("/proc/stat", O_RDONLY | O_CLOEXEC)), ns_per_jiffy_(ns_per_s / sysconf(_SC_CLK_TCK)) {}

SystemProbe::~SystemProbe() {
  if (stat_file_ >= 0) close(stat_file_);
}

std::int64_t SystemProbe::thread_cpu_ns() const noexcept {
  return used_ns(CLOCK_THREAD_CPUTIME_ID);
}

PageFaults SystemProbe::thread_faults() const noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

std::int64_t SystemProbe::host_now_ns() const noexcept {
  return MonotonicClock().now_ns();
}

std::int64_t SystemProbe::process_cpu_ns() const noexcept {
  return used_ns(CLOCK_PROCESS_CPUTIME_ID);
}

std::int64_t SystemProbe::host_steal_ns() const noexcept {
  std::array<char, 256> text{};
  if (stat_file_ < 0 || pread(stat_file_, text.data(), text.size() - 1, 0) <= 0) return 0;
  long long steal = 0;
  // cpu user nice system idle iowait irq softirq steal
  if (std::sscanf(text.data(), "cpu %*d %*d %*d %*d %*d %*d %*d %lld", &steal) != 1) return 0;
  return steal * ns_per_jiffy_;
}

std::int64_t measure_reading_ns(const Probe& probe) noexcept {
  constexpr int looks = 300;
  const MonotonicClock clock;
  const std::int64_t begin_ns = clock.now_ns();
  for (int look = 0; look < looks; ++look) {
    (void)probe.thread_cpu_ns();
    (void)probe.thread_faults();
  }
  return (clock.now_ns() - begin_ns) / looks;
}

}  // namespace hil::executive
