#pragma once
// Delays that the machine causes: the time in which runnable threads of the process waited for a processor,
// the time that the host stole, and the time by which a thread that only sleeps wakes too late. The
// difference of two readings excuses lateness between them.

#include <atomic>
#include <cstdint>
#include <thread>

#include <rtstdb/time.hpp>

namespace hil::long_test {

class MachineDelay {
 public:
  MachineDelay();
  ~MachineDelay();
  MachineDelay(const MachineDelay&) = delete;
  MachineDelay& operator=(const MachineDelay&) = delete;

  /// The sum since the start of the program. Takes some microseconds for each thread.
  rtstdb::Nanoseconds total() const;

 private:
  void measure_oversleep() noexcept;

  std::atomic<bool> done_{false};
  std::atomic<std::int64_t> overslept_ns_{0};
  std::thread sleeper_;
};

}  // namespace hil::long_test
