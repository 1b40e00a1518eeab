#include "rtstdb/gpu/loader.hpp"

#include <dlfcn.h>

namespace rtstdb::gpu {

Result<VulkanEntry> load_vulkan(const std::string& library) {
  void* handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* entry = handle != nullptr ? dlsym(handle, "vkGetInstanceProcAddr") : nullptr;
  if (entry == nullptr) {
    const char* reason = dlerror();
    return Error{ErrorCode::no_device, "no Vulkan device: the Vulkan loader " + library +
                                           " can not be used (" +
                                           (reason != nullptr ? reason : "no reason given") +
                                           "); install libvulkan1 and mesa-vulkan-drivers"};
  }
  return VulkanEntry{reinterpret_cast<void (*)()>(entry)};
}

}  // namespace rtstdb::gpu
