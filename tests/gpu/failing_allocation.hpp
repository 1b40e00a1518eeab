#pragma once
// Allocations of C++ that fail on demand, in a program that links failing_allocation.cpp. Only this program's
// own count: those with nothing on the stack but code of this program and of the C and C++ libraries. What
// the Vulkan loader, a layer or the driver allocates, on their threads or inside calls of ours, is theirs:
// they are other libraries, and not ours to mend.

#include <cstdint>

namespace rtstdb::test {

class FailingAllocation {
 public:
  enum class Then : std::uint8_t {
    goes_on,   ///< one fails
    runs_out,  ///< that one and all after it
  };
  /// The n-th from now on fails, counted from 1, on whatever thread; until the end of the scope.
  FailingAllocation(std::uint64_t number, Then then);
  ~FailingAllocation();
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;
  /// False: there were not so many.
  bool happened() const;
};

}  // namespace rtstdb::test
