#include "tests/gpu/failing_allocation.hpp"

#include <dlfcn.h>
#include <execinfo.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>

namespace {

std::atomic<bool> armed{false};
std::atomic<bool> runs_out{false};
std::atomic<std::uint64_t> remaining{0};  // until one fails
std::atomic<bool> happened{false};

struct Range {
  std::uintptr_t begin = 0, end = 0;
  bool holds(const void* address) const {
    const auto at = reinterpret_cast<std::uintptr_t>(address);
    return at >= begin && at < end;
  }
};

/// The code of the program and of libraries that allocate for their caller: C, C++ and the sanitizers.
struct Ranges {
  Range program;
  std::array<Range, 8> transparent;
  std::size_t transparent_count = 0;
  bool transparent_holds(const void* address) const {
    return std::any_of(transparent.begin(), transparent.begin() + transparent_count,
                       [&](const Range& range) { return range.holds(address); });
  }
};

Ranges find_ranges() {
  Ranges ranges;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* found) {
        auto& all = *static_cast<Ranges*>(found);
        Range range{UINTPTR_MAX, 0};
        for (int k = 0; k < info->dlpi_phnum; ++k) {
          const auto& segment = info->dlpi_phdr[k];
          if (segment.p_type != PT_LOAD) continue;
          range.begin = std::min<std::uintptr_t>(range.begin, info->dlpi_addr + segment.p_vaddr);
          range.end =
              std::max<std::uintptr_t>(range.end, info->dlpi_addr + segment.p_vaddr + segment.p_memsz);
        }
        const bool is_program = info->dlpi_name == nullptr || info->dlpi_name[0] == '\0';
        if (is_program && all.program.end == 0) {
          all.program = range;
        } else if (!is_program && all.transparent_count < all.transparent.size() &&
                   (std::strstr(info->dlpi_name, "libstdc++") != nullptr ||
                    std::strstr(info->dlpi_name, "libc.so") != nullptr ||
                    std::strstr(info->dlpi_name, "libasan") != nullptr ||
                    std::strstr(info->dlpi_name, "libubsan") != nullptr)) {
          all.transparent[all.transparent_count++] = range;
        }
        return 0;
      },
      &ranges);
  return ranges;
}

/// Templates of the C++ library are code of this program too, and other libraries use them: so the whole
/// stack is checked.
bool is_of_program(const void* caller) {
  static const Ranges ranges = find_ranges();
  if (!ranges.program.holds(caller) && !ranges.transparent_holds(caller)) return false;
  std::array<void*, 64> callers{};
  const int count = backtrace(callers.data(), static_cast<int>(callers.size()));
  return std::all_of(callers.begin(), callers.begin() + count, [&](const void* frame) {
    return ranges.program.holds(frame) || ranges.transparent_holds(frame);
  });
}

thread_local bool checking = false;

bool fails(const void* caller) {
  if (!armed.load(std::memory_order_relaxed) || checking) return false;
  checking = true;  // the check may allocate
  const bool of_program = is_of_program(caller);
  checking = false;
  if (!of_program) return false;
  if (happened.load()) return runs_out.load();
  if (remaining.fetch_sub(1) != 1) return false;
  happened = true;
  return true;
}

void* allocate(std::size_t size, std::size_t alignment, const void* caller) noexcept {
  if (fails(caller)) return nullptr;
  if (alignment <= alignof(std::max_align_t)) return std::malloc(size != 0 ? size : 1);
  return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}

void* or_throw(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

constexpr std::size_t usual = alignof(std::max_align_t);

}  // namespace

void* operator new(std::size_t size) {
  return or_throw(allocate(size, usual, __builtin_return_address(0)));
}
void* operator new[](std::size_t size) {
  return or_throw(allocate(size, usual, __builtin_return_address(0)));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return or_throw(allocate(size, static_cast<std::size_t>(alignment), __builtin_return_address(0)));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return allocate(size, usual, __builtin_return_address(0));
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return allocate(size, usual, __builtin_return_address(0));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace rtstdb::test {

FailingAllocation::FailingAllocation(std::uint64_t number, Then then) {
  // The first call of backtrace loads a library.
  std::array<void*, 1> caller{};
  (void)backtrace(caller.data(), 1);
  ::happened = false;
  ::runs_out = then == Then::runs_out;
  ::remaining = number;
  ::armed = true;
}

FailingAllocation::~FailingAllocation() {
  ::armed = false;
}

bool FailingAllocation::happened() const {
  return ::happened;
}

}  // namespace rtstdb::test
