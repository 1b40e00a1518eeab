#pragma once
// The Vulkan loader library, opened at run time.

#include <rtstdb/result.hpp>

namespace rtstdb::gpu {

inline constexpr const char* vulkan_loader_library = "libvulkan.so.1";

struct VulkanEntry {
  void (*get_instance_proc_addr)() = nullptr;
};

/// The library stays loaded until the process ends: drivers keep threads and
/// thread-local storage, so unloading them is not safe. Errors: no_device (which library, what to install).
Result<VulkanEntry> load_vulkan(const char* library);

}  // namespace rtstdb::gpu
