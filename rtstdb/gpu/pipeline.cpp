#include <cstddef>
#include <iterator>
#include <utility>

#include "rtstdb/gpu/pipeline_impl.hpp"
#include "rtstdb/gpu/shader_reflection.hpp"

namespace rtstdb::gpu {
namespace {

vk::raii::DescriptorSetLayout create_set_layout(const vk::raii::Device& device, std::string_view letters) {
  std::vector<vk::DescriptorSetLayoutBinding> bindings;
  for (const char letter : letters) {
    bindings.emplace_back(static_cast<std::uint32_t>(bindings.size()), descriptor_type(letter), 1,
                          vk::ShaderStageFlagBits::eCompute);
  }
  return {device, vk::DescriptorSetLayoutCreateInfo({}, bindings)};
}

vk::raii::PipelineLayout create_layout(const vk::raii::Device& device, vk::DescriptorSetLayout set_layout,
                                       std::uint32_t push_constant_bytes) {
  const vk::PushConstantRange range(vk::ShaderStageFlagBits::eCompute, 0, push_constant_bytes);
  vk::PipelineLayoutCreateInfo options({}, set_layout);
  if (push_constant_bytes != 0) options.setPushConstantRanges(range);
  return {device, options};
}

/// What shaders are told of the device, by constant id.
struct Constants {
  VkBool32 fence_in_divergent_flow;
  VkBool32 lanes_together;
};

vk::raii::Pipeline create_compute_pipeline(const Device::Impl& device, vk::PipelineLayout layout,
                                           std::span<const std::uint32_t> spirv) {
  const vk::raii::ShaderModule module(device.device,
                                      vk::ShaderModuleCreateInfo({}, spirv.size_bytes(), spirv.data()));
  // shaders/common/fence.glsl and shaders/query/simd8/together.glsl say why.
  const Constants values{.fence_in_divergent_flow = device.info.software ? VK_FALSE : VK_TRUE,
                         .lanes_together = device.info.software && device.limits.lanes_together == 8};
  const vk::SpecializationMapEntry entries[] = {
      {0, offsetof(Constants, fence_in_divergent_flow), sizeof(VkBool32)},
      {1, offsetof(Constants, lanes_together), sizeof(VkBool32)}};
  const vk::SpecializationInfo constants(std::size(entries), entries, sizeof(values), &values);
  const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module, "main",
                                                &constants);
  return {device.device, device.pipeline_cache, vk::ComputePipelineCreateInfo({}, stage, layout)};
}

/// The table and the code are both ours: a difference is a fault of the build.
void check_against_table(const ShaderInfo& shader) {
  const auto code = reflect_shader(shader.spirv);
  const auto difference = code ? find_difference(shader, *code)
                               : std::optional("shader " + std::string(shader.name) +
                                               ": its code is not one compute shader in SPIR-V");
  if (difference) assertion_failed(difference->c_str(), __FILE__, __LINE__);
}

}  // namespace

Pipeline::Impl::Impl(std::shared_ptr<Device::Impl> device_in, const ShaderInfo& shader)
    : device(std::move(device_in)),
      name(shader.name),
      letters(shader.bindings),
      group_size(shader.group_size),
      push_constant_bytes(shader.push_constant_bytes),
      set_layout(create_set_layout(device->device, letters)),
      layout(create_layout(device->device, *set_layout, push_constant_bytes)),
      spirv(shader.spirv) {
  if (!device->compile_late) compile();
}

void Pipeline::Impl::compile() {
  pipeline = create_compute_pipeline(*device, *layout, spirv);
  device->name(vk::ObjectType::ePipeline, reinterpret_cast<std::uint64_t>(static_cast<VkPipeline>(*pipeline)),
               name);
}

Result<Pipeline> Device::create_pipeline(const ShaderInfo& shader) {
  check_against_table(shader);
  if (shader.group_size > impl_->max_group_size) {
    return Error{ErrorCode::capacity, "shader " + std::string(shader.name) + " runs in groups of " +
                                          std::to_string(shader.group_size) + ", the limit is " +
                                          std::to_string(impl_->max_group_size) + " on " + info().name};
  }
  return impl_->attempt("pipeline " + std::string(shader.name) + " can not be created",
                        [&]() -> Result<Pipeline> {
                          Pipeline pipeline;
                          pipeline.impl_ = std::make_unique<Pipeline::Impl>(impl_, shader);
                          return pipeline;
                        });
}

Result<Pipeline> Device::create_pipeline(ShaderId shader) {
  return create_pipeline(shader_info(shader));
}

Pipeline::Pipeline() = default;
Pipeline::~Pipeline() = default;
Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;

std::uint32_t Pipeline::group_size() const noexcept {
  RTSTDB_ASSERT(impl_ != nullptr);
  return impl_->group_size;
}

}  // namespace rtstdb::gpu
