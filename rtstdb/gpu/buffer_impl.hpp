#pragma once

#include "rtstdb/gpu/device_impl.hpp"

namespace rtstdb::gpu {

struct Buffer::Impl {
  /// Counts as one of the device's limited number of memory allocations while it lives.
  struct Allocation {
    explicit Allocation(Device::Impl& device_in) : device(&device_in) { ++device->allocations; }
    Allocation(const Allocation&) = delete;
    Allocation& operator=(const Allocation&) = delete;
    ~Allocation() { --device->allocations; }
    Device::Impl* device;
  };

  std::shared_ptr<Device::Impl> device;
  BufferOptions options;
  Allocation allocation;
  vk::raii::DeviceMemory memory{nullptr};
  vk::raii::Buffer buffer{nullptr};
  vk::raii::BufferView texel_uint4{nullptr};
  vk::raii::BufferView texel_float4{nullptr};
  std::uint64_t address = 0;    ///< 0 unless addressed
  std::byte* mapped = nullptr;  ///< null for Memory::device
  /// The caller's HostMemory where the device works on a copy of it; else null
  std::byte* host_copy = nullptr;

  Impl(std::shared_ptr<Device::Impl> device_in, const BufferOptions& options_in);
};

}  // namespace rtstdb::gpu
