// A Vulkan loader in front of the real one (DeviceOptions::loader_library): selected functions of a device
// fail, or the device is lost at a selected call. Tests use it through fault_loader.hpp.

#include <dlfcn.h>
#include <vulkan/vulkan_core.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>

// The functions of a device that rtstdb calls and that return errors.
#define FALLIBLE_FUNCTIONS(F)            \
  F(vkAllocateCommandBuffers)            \
  F(vkAllocateDescriptorSets)            \
  F(vkAllocateMemory)                    \
  F(vkBeginCommandBuffer)                \
  F(vkBindBufferMemory)                  \
  F(vkCreateBuffer)                      \
  F(vkCreateBufferView)                  \
  F(vkCreateCommandPool)                 \
  F(vkCreateComputePipelines)            \
  F(vkCreateDescriptorPool)              \
  F(vkCreateDescriptorSetLayout)         \
  F(vkCreatePipelineCache)               \
  F(vkCreatePipelineLayout)              \
  F(vkCreateQueryPool)                   \
  F(vkCreateSemaphore)                   \
  F(vkCreateShaderModule)                \
  F(vkEndCommandBuffer)                  \
  F(vkGetMemoryHostPointerPropertiesEXT) \
  F(vkGetPipelineCacheData)              \
  F(vkGetQueryPoolResults)               \
  F(vkMapMemory)                         \
  F(vkQueueSubmit2)                      \
  F(vkResetCommandPool)                  \
  F(vkWaitSemaphores)

namespace {

enum Function : std::uint8_t {
#define FUNCTION_INDEX(name) at_##name,
  FALLIBLE_FUNCTIONS(FUNCTION_INDEX)
#undef FUNCTION_INDEX
      at_vkCreateDevice,  // NOLINT(readability-identifier-naming): Vulkan's name
  function_count
};

constexpr std::array<const char*, function_count> function_names{
#define FUNCTION_NAME(name) #name,
    FALLIBLE_FUNCTIONS(FUNCTION_NAME)
#undef FUNCTION_NAME
        "vkCreateDevice"};

/// After `after` calls, `times` calls return `result` and do nothing.
struct Setting {
  std::atomic<int> result{VK_SUCCESS};
  std::atomic<int> after{0};
  std::atomic<int> times{0};
};
std::array<Setting, function_count> settings;

std::atomic<std::uint64_t> calls{0};
std::atomic<std::uint64_t> lost_at_call{0};  // 0: never
std::atomic<bool> lost{false};               // the device that was created last
std::atomic<VkDevice> last_device{VK_NULL_HANDLE};
std::atomic<int> live_devices{0};
std::atomic<int> live_allocations{0};

std::atomic<std::uint32_t> groups_allowed{0};  // 0: the limit of the device
std::atomic<std::uint64_t> groups_recorded{0};

PFN_vkGetInstanceProcAddr real_get_instance_proc_addr = nullptr;
PFN_vkGetPhysicalDeviceProperties2 real_get_properties = nullptr;
PFN_vkGetDeviceProcAddr real_get_device_proc_addr = nullptr;
std::array<PFN_vkVoidFunction, function_count> real_functions{};
PFN_vkDestroyDevice real_destroy_device = nullptr;
PFN_vkFreeMemory real_free_memory = nullptr;
PFN_vkCmdDispatch real_dispatch = nullptr;

/// Waits for the device first: a lost device executes nothing.
void lose() {
  const VkDevice device = last_device;
  if (device != VK_NULL_HANDLE) {
    const auto wait_idle =
        reinterpret_cast<PFN_vkDeviceWaitIdle>(real_get_device_proc_addr(device, "vkDeviceWaitIdle"));
    wait_idle(device);
  }
  lost = true;
}

/// The result that the call returns; VK_SUCCESS: the real function is called.
VkResult fault_of(Function function) {
  Setting& setting = settings[function];
  if (setting.after > 0) {
    --setting.after;
  } else if (setting.times > 0) {
    --setting.times;
    return static_cast<VkResult>(setting.result.load());
  }
  const std::uint64_t call = ++calls;
  if (call == lost_at_call) lose();
  return lost ? VK_ERROR_DEVICE_LOST : VK_SUCCESS;
}

template <Function function, class Pointer>
struct Wrapped;
template <Function function, class... Arguments>
struct Wrapped<function, VkResult(VKAPI_PTR*)(Arguments...)> {
  static VKAPI_ATTR VkResult VKAPI_CALL call(Arguments... arguments) {
    if (const VkResult fault = fault_of(function); fault != VK_SUCCESS) return fault;
    using Pointer = VkResult(VKAPI_PTR*)(Arguments...);
    const VkResult result = reinterpret_cast<Pointer>(real_functions[function])(arguments...);
    if (function == at_vkAllocateMemory && result == VK_SUCCESS) ++live_allocations;
    return result;
  }
};

constexpr std::array<PFN_vkVoidFunction (*)(), function_count> wrappers{
#define FUNCTION_WRAPPER(name) \
  [] { return reinterpret_cast<PFN_vkVoidFunction>(&Wrapped<at_##name, PFN_##name>::call); },
    FALLIBLE_FUNCTIONS(FUNCTION_WRAPPER)
#undef FUNCTION_WRAPPER
};

VKAPI_ATTR void VKAPI_CALL destroy_device(VkDevice device, const VkAllocationCallbacks* allocator) {
  if (device != VK_NULL_HANDLE) --live_devices;
  VkDevice expected = device;
  last_device.compare_exchange_strong(expected, VK_NULL_HANDLE);
  real_destroy_device(device, allocator);
}

VKAPI_ATTR void VKAPI_CALL free_memory(VkDevice device, VkDeviceMemory memory,
                                       const VkAllocationCallbacks* allocator) {
  if (memory != VK_NULL_HANDLE) --live_allocations;
  real_free_memory(device, memory, allocator);
}

VKAPI_ATTR void VKAPI_CALL dispatch(VkCommandBuffer commands, std::uint32_t x, std::uint32_t y,
                                    std::uint32_t z) {
  groups_recorded += std::uint64_t{x} * y * z;
  real_dispatch(commands, x, y, z);
}

VKAPI_ATTR void VKAPI_CALL get_properties(VkPhysicalDevice physical_device,
                                          VkPhysicalDeviceProperties2* properties) {
  real_get_properties(physical_device, properties);
  if (groups_allowed != 0) properties->properties.limits.maxComputeWorkGroupCount[0] = groups_allowed;
}

/// A new device works.
VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical_device,
                                             const VkDeviceCreateInfo* wanted,
                                             const VkAllocationCallbacks* allocator, VkDevice* device) {
  lost = false;
  if (const VkResult fault = fault_of(at_vkCreateDevice); fault != VK_SUCCESS) {
    lost = false;
    return fault;
  }
  const VkResult result = reinterpret_cast<PFN_vkCreateDevice>(real_functions[at_vkCreateDevice])(
      physical_device, wanted, allocator, device);
  if (result == VK_SUCCESS) {
    ++live_devices;
    last_device = *device;
  }
  return result;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL device_proc_addr(VkDevice device, const char* name) {
  if (std::strcmp(name, "vkGetDeviceProcAddr") == 0) {
    return reinterpret_cast<PFN_vkVoidFunction>(&device_proc_addr);
  }
  const PFN_vkVoidFunction real = real_get_device_proc_addr(device, name);
  if (std::strcmp(name, "vkDestroyDevice") == 0) {
    real_destroy_device = reinterpret_cast<PFN_vkDestroyDevice>(real);
    return reinterpret_cast<PFN_vkVoidFunction>(&destroy_device);
  }
  if (std::strcmp(name, "vkFreeMemory") == 0) {
    real_free_memory = reinterpret_cast<PFN_vkFreeMemory>(real);
    return reinterpret_cast<PFN_vkVoidFunction>(&free_memory);
  }
  if (std::strcmp(name, "vkCmdDispatch") == 0) {
    real_dispatch = reinterpret_cast<PFN_vkCmdDispatch>(real);
    return reinterpret_cast<PFN_vkVoidFunction>(&dispatch);
  }
  for (std::size_t k = 0; k < at_vkCreateDevice; ++k) {
    if (real == nullptr || std::strcmp(name, function_names[k]) != 0) continue;
    real_functions[k] = real;
    return wrappers[k]();
  }
  return real;
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) PFN_vkVoidFunction vkGetInstanceProcAddr(VkInstance instance,
                                                                                const char* name) {
  if (real_get_instance_proc_addr == nullptr) {
    void* loader = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    if (loader == nullptr) return nullptr;
    real_get_instance_proc_addr =
        reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(loader, "vkGetInstanceProcAddr"));
  }
  const PFN_vkVoidFunction real = real_get_instance_proc_addr(instance, name);
  if (std::strcmp(name, "vkGetDeviceProcAddr") == 0) {
    real_get_device_proc_addr = reinterpret_cast<PFN_vkGetDeviceProcAddr>(real);
    return reinterpret_cast<PFN_vkVoidFunction>(&device_proc_addr);
  }
  if (std::strcmp(name, "vkGetPhysicalDeviceProperties2") == 0 && real != nullptr) {
    real_get_properties = reinterpret_cast<PFN_vkGetPhysicalDeviceProperties2>(real);
    return reinterpret_cast<PFN_vkVoidFunction>(&get_properties);
  }
  if (std::strcmp(name, "vkCreateDevice") == 0 && real != nullptr) {
    real_functions[at_vkCreateDevice] = real;
    return reinterpret_cast<PFN_vkVoidFunction>(&create_device);
  }
  return real;
}

__attribute__((visibility("default"))) int set_vulkan_fault(const char* function, int result, int times,
                                                            int after) {
  for (std::size_t k = 0; k < function_count; ++k) {
    if (std::strcmp(function, function_names[k]) != 0) continue;
    settings[k].result = result;
    settings[k].after = after;
    settings[k].times = times;
    return 0;
  }
  return -1;
}

__attribute__((visibility("default"))) void lose_vulkan_device_at_call(std::uint64_t call) {
  lost_at_call = 0;
  calls = 0;
  lost_at_call = call;
}

__attribute__((visibility("default"))) void allow_vulkan_groups(std::uint32_t groups) {
  groups_allowed = groups;
}

__attribute__((visibility("default"))) std::uint64_t vulkan_groups() {
  return groups_recorded;
}

__attribute__((visibility("default"))) std::uint64_t vulkan_calls() {
  return calls;
}

__attribute__((visibility("default"))) int live_vulkan_devices() {
  return live_devices;
}

__attribute__((visibility("default"))) int live_vulkan_allocations() {
  return live_allocations;
}
}
