#pragma once
// Counts heap traffic in threads that say they are in the tick. For test programs: linking this in replaces
// malloc and its family (operator new and delete go through them) in the whole program; under
// AddressSanitizer and ThreadSanitizer, which have a malloc of their own, it listens through their hooks
// instead.
//
// A thread is outside the tick until it says so.

#include <cstdint>

namespace hil::allocation_guard {

/// False under ThreadSanitizer, whose hooks are silent about aligned_alloc, posix_memalign and over-aligned
/// new.
bool sees_aligned_allocations() noexcept;

/// From here to leave_tick() the calling thread's allocations and frees are counted. Calls do not nest.
void enter_tick() noexcept;
void leave_tick() noexcept;

struct Traffic {
  std::uint64_t allocations = 0;  ///< malloc, calloc, realloc, aligned kinds
  std::uint64_t frees = 0;        ///< of something; free(nullptr) is none
  std::uint64_t total() const noexcept { return allocations + frees; }
};

/// Of all threads, since the start or the last reset().
Traffic seen() noexcept;
void reset() noexcept;

/// With true, the next one in a tick ends the program at the place where it happens (for a debugger).
void abort_on_traffic(bool abort) noexcept;

}  // namespace hil::allocation_guard
