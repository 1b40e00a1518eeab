#pragma once
// The private state of a device, shared by the sources of this folder. Every object of a device holds a
// reference to it, so the owner may destroy objects in any order.

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "rtstdb/gpu/device.hpp"
#include "rtstdb/gpu/instance.hpp"
#include "rtstdb/gpu/memory_choice.hpp"
#include "rtstdb/gpu/vulkan.hpp"

namespace rtstdb::gpu {

struct Kernel;

struct Device::Impl {
  std::unique_ptr<Instance> instance;
  vk::raii::PhysicalDevice physical_device;
  DeviceInfo info;
  DeviceLimits limits;
  std::uint32_t max_allocations = 0;
  std::uint32_t max_group_size = 0;
  double timestamp_period_ns = 0.0;
  std::uint32_t timestamp_bits = 0;
  std::vector<MemoryTraits> memory_types;
  std::uint32_t queue_family = 0;
  bool imports_host_memory = false;
  bool compile_on_first_dispatch = false;
  vk::raii::Device device;
  vk::raii::Queue queue;
  vk::raii::PipelineCache pipeline_cache;
  std::mutex kernels_mutex;
  std::map<ShaderId, std::shared_ptr<Kernel>> kernels;  ///< of the pipelines created so far
  /// VkQueueSubmit needs external synchronization; several timelines may submit at once
  std::mutex queue_mutex;
  std::atomic<bool> lost{false};
  std::atomic<std::uint32_t> allocations{0};

  Impl(std::unique_ptr<Instance> instance_in, const PhysicalDevice& chosen, const DeviceOptions& options);

  const vk::raii::DeviceDispatcher& vk() const { return *device.getDispatcher(); }
  void name(vk::ObjectType type, std::uint64_t handle, const std::string& text) const;
  /// Tries the suitable memory types from best to worst, since the best one may be small and full. Throws
  /// vk::OutOfDeviceMemoryError when all are. `next`: the next structure of the request.
  vk::raii::DeviceMemory allocate(const vk::MemoryRequirements& needs, Memory purpose,
                                  const void* next = nullptr) const;

  /// Runs a setup step and turns the exceptions of Vulkan-Hpp into an Error, whose text begins with `what`.
  template <class Step>
  auto attempt(const std::string& what, Step step) -> decltype(step()) {
    if (lost) return Error{ErrorCode::device_lost, what + ": the device is lost"};
    try {
      return step();
    } catch (const vk::SystemError& failure) {
      Error error = to_error(failure, what);
      if (error.code == ErrorCode::device_lost) lost = true;
      return error;
    }
  }
};

}  // namespace rtstdb::gpu
