#include "tests/support/failing_new.hpp"

#include <pthread.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>

namespace hil::tests {
namespace {

std::atomic<bool> armed{false};
std::atomic<int> allowed{0};
std::array<char, 16> failing_name{};

bool fails() noexcept {
  if (!armed.load(std::memory_order_acquire)) return false;
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  return name == failing_name && allowed.fetch_sub(1, std::memory_order_relaxed) <= 0;
}

void* allocate(std::size_t bytes) {
  void* memory = fails() ? nullptr : std::malloc(bytes == 0 ? 1 : bytes);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void* allocate(std::size_t bytes, std::align_val_t alignment) {
  const auto align = static_cast<std::size_t>(alignment);
  void* memory = fails() ? nullptr : std::aligned_alloc(align, (bytes + align - 1) / align * align);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void fail_allocations_of(const char* thread_name, int after) {
  failing_name.fill('\0');
  std::strncpy(failing_name.data(), thread_name, failing_name.size() - 1);
  allowed.store(after, std::memory_order_relaxed);
  armed.store(true, std::memory_order_release);
}

void stop_failing_allocations() {
  armed.store(false, std::memory_order_release);
}

bool allocations_failed() {
  return allowed.load(std::memory_order_relaxed) < 0;
}

}  // namespace hil::tests

void* operator new(std::size_t bytes) {
  return hil::tests::allocate(bytes);
}
void* operator new[](std::size_t bytes) {
  return hil::tests::allocate(bytes);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return hil::tests::allocate(bytes, alignment);
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return hil::tests::allocate(bytes, alignment);
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
void operator delete[](void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
