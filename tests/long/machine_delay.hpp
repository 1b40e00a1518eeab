#pragma once
// What the machine itself took of the time between two instants: read before and after something that may
// have been late. Threads that could run and did not, by the kernel's account; time stolen by the host; and
// how much a bare thread beside them overslept.

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include <rtstdb/time.hpp>

namespace hil::stress {

class MachineTime {
 public:
  MachineTime();
  ~MachineTime();
  MachineTime(const MachineTime&) = delete;
  MachineTime& operator=(const MachineTime&) = delete;

  /// The calling thread is not one of those that the work in question waits for.
  void leave_this_thread_out();
  /// All of the three since the program began. Takes some microseconds for each thread.
  rtstdb::Nanoseconds taken() const;

 private:
  void oversleep() noexcept;

  std::atomic<bool> done_{false};
  std::atomic<std::int64_t> overslept_ns_{0};
  std::vector<int> left_out_;
  std::thread bare_;
};

}  // namespace hil::stress
