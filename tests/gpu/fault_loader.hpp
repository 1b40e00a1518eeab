#pragma once
// The interface of fault_loader.cpp for tests.

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace rtstdb::gpu::test {

/// Faults hold for the whole process, until the end of this object.
class FaultLoader {
 public:
  // Values of VkResult; only rtstdb/gpu includes the headers of Vulkan.
  static constexpr int out_of_host_memory = -1;
  static constexpr int out_of_device_memory = -2;
  static constexpr int device_lost = -4;
  static constexpr int invalid_external_handle = -1'000'072'003;
  static constexpr int for_ever = std::numeric_limits<int>::max();

  FaultLoader() = default;
  ~FaultLoader() {
    lose_at_call(0);
    allow_groups(0);
    for (const char* function : changed_)
      if (function != nullptr) set_(function, 0, 0, 0);
  }
  FaultLoader(const FaultLoader&) = delete;
  FaultLoader& operator=(const FaultLoader&) = delete;

  /// After `after` further calls, the next `times` calls of the function return `result` and do nothing.
  void fail(const char* function, int result, int times, int after = 0) {
    ASSERT_EQ(set_(function, result, times, after), 0) << function;
    for (const char*& changed : changed_) {
      if (changed != nullptr && changed != function) continue;
      changed = function;
      return;
    }
    FAIL() << "increase the size of changed_";
  }
  /// Devices that are opened from now on report this limit of groups in a dispatch; 0: the true limit.
  void allow_groups(std::uint32_t groups) { allow_groups_(groups); }
  /// In all dispatches that were recorded, without indirect ones.
  std::uint64_t groups() const { return groups_(); }
  /// Loses the device at the n-th call from now on that can fail, of any device. A new device works. 0:
  /// never.
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
  const char* changed_[8] = {};
};

}  // namespace rtstdb::gpu::test
