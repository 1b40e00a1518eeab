#pragma once
// The Vulkan loader library, opened at run time.

#include <string>

#include <rtstdb/result.hpp>

namespace rtstdb::gpu {

struct VulkanEntry {
  void (*get_instance_proc_addr)() = nullptr;
};

/// The library stays loaded until the process ends: drivers keep threads and thread-local storage, so
/// unloading them is not safe. Errors: no_device (which library, what to install).
Result<VulkanEntry> load_vulkan(const std::string& library);

}  // namespace rtstdb::gpu
