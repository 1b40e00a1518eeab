#pragma once
// Allocations by operator new that fail on demand, in a program that links failing_allocation.cpp. Only
// allocations of the program count: those with nothing on the stack but code of the program and of the C and
// C++ libraries. Allocations of the Vulkan loader, a layer or the driver do not count.

#include <cstdint>

namespace rtstdb::test {

class FailingAllocation {
 public:
  enum class Then : std::uint8_t {
    goes_on,   ///< one allocation fails
    runs_out,  ///< that one and all later ones fail
  };
  /// The n-th allocation from now on fails, counted from 1, on any thread; until the end of this object.
  FailingAllocation(std::uint64_t number, Then then);
  ~FailingAllocation();
  FailingAllocation(const FailingAllocation&) = delete;
  FailingAllocation& operator=(const FailingAllocation&) = delete;
  /// False: there were fewer allocations.
  bool happened() const;
};

}  // namespace rtstdb::test
