#pragma once
// Counts heap allocations and frees of threads in the tick. Linking it replaces malloc and its family, which
// operator new and delete call, in the whole test program. Under AddressSanitizer and ThreadSanitizer, which
// replace malloc themselves, it uses their hooks; those of ThreadSanitizer do not report aligned_alloc,
// posix_memalign and over-aligned new.

#include <cstdint>

namespace hil::allocation_guard {

/// Counts the allocations and frees of the calling thread until leave_tick(). Calls do not nest.
void enter_tick() noexcept;
void leave_tick() noexcept;

struct Traffic {
  std::uint64_t allocations = 0;  ///< malloc, calloc, realloc, aligned kinds
  std::uint64_t frees = 0;        ///< without free(nullptr)
  std::uint64_t total() const noexcept { return allocations + frees; }
};

/// Of all threads, since the start or the last reset().
Traffic seen() noexcept;
void reset() noexcept;

}  // namespace hil::allocation_guard
