#pragma once

#include "rtstdb/gpu/device_impl.hpp"
#include "rtstdb/gpu/raster.hpp"

namespace rtstdb::gpu {

/// An image with its memory.
struct Attachment {
  vk::raii::Image image{nullptr};  ///< null: the target has none
  vk::raii::DeviceMemory memory{nullptr};
  vk::raii::ImageView view{nullptr};
};

struct RasterTarget::Impl {
  std::shared_ptr<Device::Impl> device;
  RasterTargetOptions options;
  Attachment words, depth;

  Impl(std::shared_ptr<Device::Impl> device_in, const RasterTargetOptions& options_in);
};

struct RasterPipeline::Impl {
  std::shared_ptr<Device::Impl> device;
  std::string letters;  ///< of the vertex shader
  std::uint32_t push_constant_bytes = 0;
  bool has_words = false;
  vk::raii::DescriptorSetLayout set_layout{nullptr};
  vk::raii::PipelineLayout layout{nullptr};
  vk::raii::Pipeline pipeline{nullptr};
};

}  // namespace rtstdb::gpu
