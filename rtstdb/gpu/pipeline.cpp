#include <cstddef>
#include <iterator>
#include <mutex>
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

/// Specialization constants, one member per constant id.
struct Constants {
  VkBool32 fence_in_divergent_flow;
  VkBool32 lanes_together;
};

vk::raii::Pipeline create_compute_pipeline(const Device::Impl& device, vk::PipelineLayout layout,
                                           std::span<const std::uint32_t> spirv) {
  const vk::raii::ShaderModule module(device.device,
                                      vk::ShaderModuleCreateInfo({}, spirv.size_bytes(), spirv.data()));
  // shaders/common/fence.glsl and shaders/query/simd8/together.glsl give the reasons.
  const Constants values{.fence_in_divergent_flow = device.info.software ? VK_FALSE : VK_TRUE,
                         .lanes_together = device.info.software && device.limits.subgroup_size == 8};
  const vk::SpecializationMapEntry entries[] = {
      {0, offsetof(Constants, fence_in_divergent_flow), sizeof(VkBool32)},
      {1, offsetof(Constants, lanes_together), sizeof(VkBool32)}};
  const vk::SpecializationInfo constants(std::size(entries), entries, sizeof(values), &values);
  const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module, "main",
                                                &constants);
  return {device.device, device.pipeline_cache, vk::ComputePipelineCreateInfo({}, stage, layout)};
}

/// Both the table and the SPIR-V come from the build, so a difference is an internal fault.
void check_against_table(const ShaderInfo& shader) {
  const auto code = reflect_shader(shader.spirv);
  const auto difference = code ? find_difference(shader, *code)
                               : std::optional("shader " + std::string(shader.name) +
                                               ": its code is not one compute shader in SPIR-V");
  if (difference) assertion_failed(difference->c_str(), __FILE__, __LINE__);
}

}  // namespace

Kernel::Kernel(const Device::Impl& device, const ShaderInfo& shader)
    : name(shader.name),
      spirv(shader.spirv),
      set_layout(create_set_layout(device.device, shader.bindings)),
      layout(create_layout(device.device, *set_layout, shader.push_constant_bytes)) {}

void Kernel::compile(const Device::Impl& device) {
  std::call_once(compiled, [&] {
    pipeline = create_compute_pipeline(device, *layout, spirv);
    device.name(vk::ObjectType::ePipeline,
                reinterpret_cast<std::uint64_t>(static_cast<VkPipeline>(*pipeline)), name);
  });
}

Pipeline::Impl::Impl(std::shared_ptr<Device::Impl> device_in, std::shared_ptr<Kernel> kernel_in,
                     const ShaderInfo& shader)
    : device(std::move(device_in)),
      kernel(std::move(kernel_in)),
      letters(shader.bindings),
      group_size(shader.group_size),
      push_constant_bytes(shader.push_constant_bytes) {
  if (!device->compile_on_first_dispatch) kernel->compile(*device);
}

Result<Pipeline> Device::create_pipeline(const ShaderInfo& shader, std::shared_ptr<Kernel>& kernel) {
  RTSTDB_ASSERT(shader.stage() == ShaderStage::compute, "the shader is not a compute shader");
  check_against_table(shader);
  if (shader.group_size > impl_->max_group_size) {
    return Error{ErrorCode::capacity, "shader " + std::string(shader.name) + " runs in groups of " +
                                          std::to_string(shader.group_size) + ", the limit is " +
                                          std::to_string(impl_->max_group_size) + " on " + info().name};
  }
  return impl_->attempt("pipeline " + std::string(shader.name) + " can not be created",
                        [&]() -> Result<Pipeline> {
                          if (!kernel) kernel = std::make_shared<Kernel>(*impl_, shader);
                          Pipeline pipeline;
                          pipeline.impl_ = std::make_unique<Pipeline::Impl>(impl_, kernel, shader);
                          return pipeline;
                        });
}

Result<Pipeline> Device::create_pipeline(const ShaderInfo& shader) {
  std::shared_ptr<Kernel> kernel;
  return create_pipeline(shader, kernel);
}

Result<Pipeline> Device::create_pipeline(ShaderId shader) {
  const std::lock_guard lock(impl_->kernels_mutex);
  return create_pipeline(shader_info(shader), impl_->kernels[shader]);
}

Pipeline::Pipeline() = default;
Pipeline::~Pipeline() = default;
Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;

std::uint32_t Pipeline::group_size() const noexcept {
  RTSTDB_ASSERT(impl_ != nullptr, "the pipeline was moved from");
  return impl_->group_size;
}

}  // namespace rtstdb::gpu
