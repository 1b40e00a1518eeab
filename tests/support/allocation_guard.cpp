#include "tests/support/allocation_guard.hpp"

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HIL_SANITIZER_MALLOC 1
// From the sanitizers' allocator_interface.h, which not every compiler package brings along.
// NOLINTNEXTLINE(bugprone-reserved-identifier, readability-identifier-naming)
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*malloc_hook)(const volatile void*,
                                                                             std::size_t),
                                                         void (*free_hook)(const volatile void*));
#else
#define HIL_SANITIZER_MALLOC 0
#endif

namespace hil::allocation_guard {
namespace {

constinit thread_local bool in_tick = false;
constinit std::atomic<std::uint64_t> allocations{0};
constinit std::atomic<std::uint64_t> frees{0};

void count(std::atomic<std::uint64_t>& kind) noexcept {
  if (in_tick) kind.fetch_add(1, std::memory_order_relaxed);
}

#if HIL_SANITIZER_MALLOC
const bool listening = [] {
  const auto on_allocation = [](const volatile void*, std::size_t) { count(allocations); };
  const auto on_free = [](const volatile void* memory) {
    if (memory != nullptr) count(frees);
  };
  return __sanitizer_install_malloc_and_free_hooks(on_allocation, on_free) > 0;
}();
#endif

}  // namespace

void enter_tick() noexcept {
#if HIL_SANITIZER_MALLOC
  if (!listening) std::abort();
#endif
  in_tick = true;
}

void leave_tick() noexcept {
  in_tick = false;
}

Traffic seen() noexcept {
  return {allocations.load(std::memory_order_relaxed), frees.load(std::memory_order_relaxed)};
}

void reset() noexcept {
  allocations.store(0, std::memory_order_relaxed);
  frees.store(0, std::memory_order_relaxed);
}

}  // namespace hil::allocation_guard

#if !HIL_SANITIZER_MALLOC

// glibc's own entry points stand behind the ones replaced here.
extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier, readability-identifier-naming): the names are glibc's.
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);
// NOLINTEND(bugprone-reserved-identifier, readability-identifier-naming)

void* malloc(std::size_t size) {
  hil::allocation_guard::count(hil::allocation_guard::allocations);
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  hil::allocation_guard::count(hil::allocation_guard::allocations);
  return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) {
  hil::allocation_guard::count(hil::allocation_guard::allocations);
  return __libc_realloc(memory, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  hil::allocation_guard::count(hil::allocation_guard::allocations);
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return memalign(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  const bool power_of_two = alignment != 0 && (alignment & (alignment - 1)) == 0;
  if (!power_of_two || alignment % sizeof(void*) != 0) return EINVAL;
  void* const taken = memalign(alignment, size);
  if (taken == nullptr) return ENOMEM;
  *memory = taken;
  return 0;
}

void free(void* memory) {
  if (memory != nullptr) hil::allocation_guard::count(hil::allocation_guard::frees);
  __libc_free(memory);
}
}  // extern "C"

#endif
