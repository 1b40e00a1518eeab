#pragma once
// Opens the Vulkan loader library at run time.

#include <string>

#include <rtstdb/result.hpp>

namespace rtstdb::gpu {

struct VulkanEntry {
  void (*get_instance_proc_addr)() = nullptr;
};

/// The library stays loaded until the process ends, since drivers keep threads and thread-local storage.
/// Errors: no_device, with the library's name and what to install.
Result<VulkanEntry> load_vulkan(const std::string& library);

}  // namespace rtstdb::gpu
