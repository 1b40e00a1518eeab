// A Vulkan loader that passes everything on to the real one, except that chosen functions of a device fail as
// a real device may: rtstdb opens it in the loader's place (DeviceOptions::loader_library).

#include <dlfcn.h>
#include <vulkan/vulkan_core.h>

#include <atomic>
#include <cstring>

namespace {

enum Fault { fault_allocate, fault_submit, fault_wait, fault_query, fault_pipeline, fault_count };

constexpr const char* function_names[fault_count] = {"vkAllocateMemory", "vkQueueSubmit2", "vkWaitSemaphores",
                                                     "vkGetQueryPoolResults", "vkCreateComputePipelines"};

/// The result that the next `times` calls give instead of doing anything; 0 times: all is well.
struct Setting {
  std::atomic<int> result{VK_SUCCESS};
  std::atomic<int> times{0};
};
Setting settings[fault_count];

PFN_vkGetInstanceProcAddr real_get_instance_proc_addr = nullptr;
PFN_vkGetDeviceProcAddr real_get_device_proc_addr = nullptr;
PFN_vkVoidFunction real_functions[fault_count] = {};

template <Fault fault, class Function>
struct Wrapped;
template <Fault fault, class... Arguments>
struct Wrapped<fault, VkResult(VKAPI_PTR*)(Arguments...)> {
  static VKAPI_ATTR VkResult VKAPI_CALL call(Arguments... arguments) {
    if (settings[fault].times > 0) {
      --settings[fault].times;
      return static_cast<VkResult>(settings[fault].result.load());
    }
    using Function = VkResult(VKAPI_PTR*)(Arguments...);
    return reinterpret_cast<Function>(real_functions[fault])(arguments...);
  }
};

template <Fault fault, class Function>
PFN_vkVoidFunction wrapped() {
  return reinterpret_cast<PFN_vkVoidFunction>(&Wrapped<fault, Function>::call);
}

PFN_vkVoidFunction wrapper_of(int fault) {
  switch (fault) {
    case fault_allocate:
      return wrapped<fault_allocate, PFN_vkAllocateMemory>();
    case fault_submit:
      return wrapped<fault_submit, PFN_vkQueueSubmit2>();
    case fault_wait:
      return wrapped<fault_wait, PFN_vkWaitSemaphores>();
    case fault_query:
      return wrapped<fault_query, PFN_vkGetQueryPoolResults>();
    default:
      return wrapped<fault_pipeline, PFN_vkCreateComputePipelines>();
  }
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL device_proc_addr(VkDevice device, const char* name) {
  if (std::strcmp(name, "vkGetDeviceProcAddr") == 0) {
    return reinterpret_cast<PFN_vkVoidFunction>(&device_proc_addr);
  }
  const PFN_vkVoidFunction real = real_get_device_proc_addr(device, name);
  for (int fault = 0; fault < fault_count; ++fault) {
    if (std::strcmp(name, function_names[fault]) != 0) continue;
    real_functions[fault] = real;
    return wrapper_of(fault);
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
  if (std::strcmp(name, "vkGetDeviceProcAddr") != 0) return real;
  real_get_device_proc_addr = reinterpret_cast<PFN_vkGetDeviceProcAddr>(real);
  return reinterpret_cast<PFN_vkVoidFunction>(&device_proc_addr);
}

/// Returns 0, or -1 when there is no such function here.
__attribute__((visibility("default"))) int set_vulkan_fault(const char* function, int result, int times) {
  for (int fault = 0; fault < fault_count; ++fault) {
    if (std::strcmp(function, function_names[fault]) != 0) continue;
    settings[fault].result = result;
    settings[fault].times = times;
    return 0;
  }
  return -1;
}
}
