#include "rtstdb/gpu/loader.hpp"

#include <dlfcn.h>

#include <string>

namespace rtstdb::gpu {

Result<VulkanEntry> load_vulkan(const char* library) {
  void* handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  void* entry = handle != nullptr ? dlsym(handle, "vkGetInstanceProcAddr") : nullptr;
  if (entry == nullptr) {
    const char* reason = dlerror();
    return Error{ErrorCode::no_device, std::string("no Vulkan device: the Vulkan loader ") + library +
                                           " can not be used (" +
                                           (reason != nullptr ? reason : "no reason given") +
                                           "); install libvulkan1 and mesa-vulkan-drivers"};
  }
  return VulkanEntry{reinterpret_cast<void (*)()>(entry)};
}

}  // namespace rtstdb::gpu
