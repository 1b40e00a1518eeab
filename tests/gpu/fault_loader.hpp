#pragma once
// The tests' side of fault_loader.cpp.

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace rtstdb::gpu::test {

/// For the whole process: tests that use it leave it as it was.
class FaultLoader {
 public:
  // Vulkan's numbers, which rtstdb/gpu alone may take from its headers.
  static constexpr int out_of_host_memory = -1;
  static constexpr int out_of_device_memory = -2;
  static constexpr int device_lost = -4;
  static constexpr int invalid_external_handle = -1'000'072'003;
  static constexpr int for_ever = std::numeric_limits<int>::max();

  FaultLoader() = default;
  ~FaultLoader() {
    lose_at_call(0);
    allow_groups(0);
    for (const char* function : touched_)
      if (function != nullptr) set_(function, 0, 0, 0);
  }
  FaultLoader(const FaultLoader&) = delete;
  FaultLoader& operator=(const FaultLoader&) = delete;

  /// `times` calls of the function give that result instead of doing anything: the next ones, but for the
  /// first `after`.
  void fail(const char* function, int result, int times, int after = 0) {
    ASSERT_EQ(set_(function, result, times, after), 0) << function;
    for (const char*& touched : touched_) {
      if (touched != nullptr && touched != function) continue;
      touched = function;
      return;
    }
    FAIL() << "more functions than a test should need";
  }
  /// Devices that are opened from now on say that a dispatch may have so many groups; 0: what is true.
  void allow_groups(std::uint32_t groups) { allow_groups_(groups); }
  /// In all dispatches that were ever recorded, but for indirect ones.
  std::uint64_t groups() const { return groups_(); }
  /// From the n-th call on that can fail, the device is lost, and only another one is not; counted from now
  /// on, those of all devices. 0: never.
  void lose_at_call(std::uint64_t call) { lose_(call); }
  /// Since lose_at_call.
  std::uint64_t calls() const { return calls_(); }
  int live_devices() const { return devices_(); }
  int live_allocations() const { return allocations_(); }

 private:
  static void* library() {
    static void* const opened = dlopen(FAULT_LOADER, RTLD_NOW | RTLD_LOCAL);
    return opened;
  }
  template <class Function>
  static Function* find(const char* name) {
    return reinterpret_cast<Function*>(dlsym(library(), name));
  }

  int (*const set_)(const char*, int, int, int) = find<int(const char*, int, int, int)>("set_vulkan_fault");
  void (*const lose_)(std::uint64_t) = find<void(std::uint64_t)>("lose_vulkan_device_at_call");
  void (*const allow_groups_)(std::uint32_t) = find<void(std::uint32_t)>("allow_vulkan_groups");
  std::uint64_t (*const groups_)() = find<std::uint64_t()>("vulkan_groups");
  std::uint64_t (*const calls_)() = find<std::uint64_t()>("vulkan_calls");
  int (*const devices_)() = find<int()>("live_vulkan_devices");
  int (*const allocations_)() = find<int()>("live_vulkan_allocations");
  const char* touched_[8] = {};
};

}  // namespace rtstdb::gpu::test
