#include <array>
#include <optional>
#include <utility>

#include "rtstdb/gpu/pipeline_impl.hpp"
#include "rtstdb/gpu/raster_impl.hpp"
#include "rtstdb/gpu/shader_reflection.hpp"

namespace rtstdb::gpu {
namespace {

constexpr vk::Format words_format = vk::Format::eR32G32Uint;
constexpr vk::Format depth_format = vk::Format::eD32Sfloat;

Attachment create_attachment(const Device::Impl& device, const RasterTargetOptions& options,
                             vk::Format format, vk::ImageUsageFlagBits usage,
                             vk::ImageAspectFlagBits aspect) {
  Attachment made;
  const vk::ImageCreateInfo wanted({}, vk::ImageType::e2D, format, {options.width, options.height, 1}, 1, 1,
                                   vk::SampleCountFlagBits::e1, vk::ImageTiling::eOptimal,
                                   usage | vk::ImageUsageFlagBits::eTransferSrc);
  made.image = vk::raii::Image(device.device, wanted);
  device.name(vk::ObjectType::eImage, reinterpret_cast<std::uint64_t>(static_cast<VkImage>(*made.image)),
              options.name);
  made.memory = device.allocate(made.image.getMemoryRequirements(), Memory::device);
  made.image.bindMemory(*made.memory, 0);
  made.view = vk::raii::ImageView(device.device,
                                  vk::ImageViewCreateInfo({}, *made.image, vk::ImageViewType::e2D, format, {},
                                                          vk::ImageSubresourceRange(aspect, 0, 1, 0, 1)));
  return made;
}

vk::raii::DescriptorSetLayout create_vertex_layout(const vk::raii::Device& device, std::string_view letters) {
  std::vector<vk::DescriptorSetLayoutBinding> bindings;
  for (const char letter : letters) {
    bindings.emplace_back(static_cast<std::uint32_t>(bindings.size()), descriptor_type(letter), 1,
                          vk::ShaderStageFlagBits::eVertex);
  }
  return {device, vk::DescriptorSetLayoutCreateInfo({}, bindings)};
}

void check(const ShaderInfo& shader) {
  const auto code = reflect_shader(shader.spirv);
  const auto difference =
      code ? find_difference(shader, *code)
           : std::optional("shader " + std::string(shader.name) + ": its code is not one shader in SPIR-V");
  if (difference) assertion_failed(difference->c_str(), __FILE__, __LINE__);
}

vk::raii::Pipeline create_graphics_pipeline(const Device::Impl& device, vk::PipelineLayout layout,
                                            const ShaderInfo& vertex, const ShaderInfo* fragment,
                                            BeyondDepth beyond) {
  const auto module_of = [&](const ShaderInfo& shader) {
    return vk::raii::ShaderModule(
        device.device, vk::ShaderModuleCreateInfo({}, shader.spirv.size_bytes(), shader.spirv.data()));
  };
  const vk::raii::ShaderModule vertex_module = module_of(vertex);
  std::vector<vk::PipelineShaderStageCreateInfo> stages{
      {{}, vk::ShaderStageFlagBits::eVertex, *vertex_module, "main"}};
  vk::raii::ShaderModule fragment_module{nullptr};
  if (fragment != nullptr) {
    fragment_module = module_of(*fragment);
    stages.emplace_back(vk::PipelineShaderStageCreateFlags{}, vk::ShaderStageFlagBits::eFragment,
                        *fragment_module, "main");
  }
  const vk::PipelineVertexInputStateCreateInfo no_vertex_input;
  const vk::PipelineInputAssemblyStateCreateInfo triangles({}, vk::PrimitiveTopology::eTriangleList);
  const vk::PipelineViewportStateCreateInfo one_viewport({}, 1, nullptr, 1, nullptr);
  const vk::PipelineRasterizationStateCreateInfo both_sides(
      {}, beyond == BeyondDepth::clamped, VK_FALSE, vk::PolygonMode::eFill, vk::CullModeFlagBits::eNone,
      vk::FrontFace::eCounterClockwise, VK_FALSE, 0.0f, 0.0f, 0.0f, 1.0f);
  const vk::PipelineMultisampleStateCreateInfo one_sample;
  const vk::PipelineDepthStencilStateCreateInfo greatest_depth({}, VK_TRUE, VK_TRUE, vk::CompareOp::eGreater);
  const vk::PipelineColorBlendAttachmentState replaces(
      VK_FALSE, {}, {}, {}, {}, {}, {}, vk::ColorComponentFlagBits::eR | vk::ColorComponentFlagBits::eG);
  vk::PipelineColorBlendStateCreateInfo blend;
  if (fragment != nullptr) blend.setAttachments(replaces);
  constexpr std::array dynamic_states{vk::DynamicState::eViewport, vk::DynamicState::eScissor};
  const vk::PipelineDynamicStateCreateInfo dynamic({}, dynamic_states);
  vk::PipelineRenderingCreateInfo formats;
  formats.setDepthAttachmentFormat(depth_format);
  if (fragment != nullptr) formats.setColorAttachmentFormats(words_format);
  vk::GraphicsPipelineCreateInfo options({}, stages, &no_vertex_input, &triangles, nullptr, &one_viewport,
                                         &both_sides, &one_sample, &greatest_depth, &blend, &dynamic, layout);
  options.pNext = &formats;
  return {device.device, device.pipeline_cache, options};
}

}  // namespace

RasterTarget::Impl::Impl(std::shared_ptr<Device::Impl> device_in, const RasterTargetOptions& options_in)
    : device(std::move(device_in)),
      options(options_in),
      depth(create_attachment(*device, options, depth_format, vk::ImageUsageFlagBits::eDepthStencilAttachment,
                              vk::ImageAspectFlagBits::eDepth)) {
  if (options.words)
    words = create_attachment(*device, options, words_format, vk::ImageUsageFlagBits::eColorAttachment,
                              vk::ImageAspectFlagBits::eColor);
}

Result<RasterTarget> Device::create_raster_target(const RasterTargetOptions& options) {
  RTSTDB_ASSERT(limits().max_raster_side > 0 && options.width > 0 && options.height > 0,
                "the device draws no images, or the image has no pixels");
  if (options.width > limits().max_raster_side || options.height > limits().max_raster_side) {
    return Error{ErrorCode::capacity,
                 "raster target \"" + options.name + "\" of " + std::to_string(options.width) + " x " +
                     std::to_string(options.height) + " pixels exceeds the limit of " +
                     std::to_string(limits().max_raster_side) + " pixels a side on " + info().name};
  }
  return impl_->attempt("raster target \"" + options.name + "\" can not be created",
                        [&]() -> Result<RasterTarget> {
                          RasterTarget target;
                          target.impl_ = std::make_unique<RasterTarget::Impl>(impl_, options);
                          return target;
                        });
}

Result<RasterPipeline> Device::create_raster_pipeline(const ShaderInfo& shader,
                                                      const ShaderInfo* of_fragments, BeyondDepth beyond) {
  RTSTDB_ASSERT(limits().max_raster_side > 0, "the device draws no images");
  check(shader);
  if (of_fragments != nullptr) check(*of_fragments);
  return impl_->attempt(
      "raster pipeline " + std::string(shader.name) + " can not be created", [&]() -> Result<RasterPipeline> {
        RasterPipeline made;
        made.impl_ = std::make_unique<RasterPipeline::Impl>();
        RasterPipeline::Impl& pipeline = *made.impl_;
        pipeline.device = impl_;
        pipeline.letters = shader.bindings;
        pipeline.push_constant_bytes = shader.push_constant_bytes;
        pipeline.has_words = of_fragments != nullptr;
        pipeline.set_layout = create_vertex_layout(impl_->device, shader.bindings);
        const vk::PushConstantRange range(vk::ShaderStageFlagBits::eVertex, 0, shader.push_constant_bytes);
        vk::PipelineLayoutCreateInfo layout({}, *pipeline.set_layout);
        if (shader.push_constant_bytes != 0) layout.setPushConstantRanges(range);
        pipeline.layout = vk::raii::PipelineLayout(impl_->device, layout);
        pipeline.pipeline = create_graphics_pipeline(*impl_, *pipeline.layout, shader, of_fragments, beyond);
        return made;
      });
}

RasterTarget::RasterTarget() = default;
RasterTarget::~RasterTarget() = default;
RasterTarget::RasterTarget(RasterTarget&&) noexcept = default;
RasterTarget& RasterTarget::operator=(RasterTarget&&) noexcept = default;
RasterPipeline::RasterPipeline() = default;
RasterPipeline::~RasterPipeline() = default;
RasterPipeline::RasterPipeline(RasterPipeline&&) noexcept = default;
RasterPipeline& RasterPipeline::operator=(RasterPipeline&&) noexcept = default;

}  // namespace rtstdb::gpu
