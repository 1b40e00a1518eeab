#pragma once

#include <string>

#include "rtstdb/gpu/device_impl.hpp"

namespace rtstdb::gpu {

/// The descriptor type of a letter of the shader table (shader.hpp).
constexpr vk::DescriptorType descriptor_type(char letter) noexcept {
  switch (letter) {
    case 'S':
      return vk::DescriptorType::eStorageBuffer;
    case 'I':
      return vk::DescriptorType::eStorageTexelBuffer;
    default:
      return vk::DescriptorType::eUniformTexelBuffer;
  }
}

/// A shader on a device, compiled once for all pipelines that have it.
struct Kernel {
  std::string name;
  std::span<const std::uint32_t> spirv;
  vk::raii::DescriptorSetLayout set_layout;
  vk::raii::PipelineLayout layout;
  vk::raii::Pipeline pipeline{nullptr};  ///< null until it is compiled
  std::once_flag compiled;

  Kernel(const Device::Impl& device, const ShaderInfo& shader);
  /// The first call compiles. Throws the exceptions of Vulkan-Hpp; the next call then tries again.
  void compile(const Device::Impl& device);
};

struct Pipeline::Impl {
  std::shared_ptr<Device::Impl> device;
  std::shared_ptr<Kernel> kernel;
  std::string letters;  ///< one letter per binding
  std::uint32_t group_size = 0;
  std::uint32_t push_constant_bytes = 0;

  Impl(std::shared_ptr<Device::Impl> device_in, std::shared_ptr<Kernel> kernel_in, const ShaderInfo& shader);
};

struct Bindings::Impl {
  std::shared_ptr<Device::Impl> device;
  std::string letters;
  vk::raii::DescriptorPool pool{nullptr};
  vk::raii::DescriptorSet set{nullptr};  ///< null when the pipeline has no bindings
};

}  // namespace rtstdb::gpu
