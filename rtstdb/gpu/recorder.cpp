#include <exception>
#include <limits>
#include <utility>

#include "rtstdb/gpu/buffer_impl.hpp"
#include "rtstdb/gpu/pipeline_impl.hpp"
#include "rtstdb/gpu/recorder_impl.hpp"

namespace rtstdb::gpu {
namespace {

using Stage = vk::PipelineStageFlagBits2;
using Access = vk::AccessFlagBits2;

constexpr vk::PipelineStageFlags2 work_stages = Stage::eComputeShader | Stage::eAllTransfer;
constexpr vk::AccessFlags2 work_writes = Access::eShaderWrite | Access::eTransferWrite;
constexpr vk::AccessFlags2 work_reads = Access::eShaderRead | Access::eTransferRead;

void order(const vk::raii::CommandBuffer& commands, vk::PipelineStageFlags2 later_stages,
           vk::AccessFlags2 later_accesses) {
  const vk::MemoryBarrier2 barrier(work_stages, work_writes, later_stages, later_accesses);
  commands.pipelineBarrier2(vk::DependencyInfo({}, barrier));
}

void order_work(const vk::raii::CommandBuffer& commands) {
  order(commands, work_stages | Stage::eDrawIndirect | Stage::eVertexShader,
        work_reads | work_writes | Access::eIndirectCommandRead);
}

vk::raii::CommandBuffer allocate_commands(const vk::raii::Device& device, vk::CommandPool pool) {
  const vk::CommandBufferAllocateInfo one(pool, vk::CommandBufferLevel::ePrimary, 1);
  return std::move(vk::raii::CommandBuffers(device, one).front());
}

bool in_range(const Buffer::Impl& buffer, std::size_t offset, std::size_t size) {
  return offset <= buffer.options.size_bytes && size <= buffer.options.size_bytes - offset;
}

/// Compiles the pipeline if that is still to be done. False: compilation failed and the device counts as
/// lost.
bool compiled(Pipeline::Impl& pipeline) noexcept {
  try {
    pipeline.kernel->compile(*pipeline.device);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

/// Binds pipeline, bindings and push constants. False: nothing is to be dispatched.
bool bind_pipeline(const Recorder::Impl& recorder, Pipeline::Impl& pipeline, const Bindings::Impl& bindings,
                   std::span<const std::byte> push_constants) {
  RTSTDB_ASSERT(recorder.state == Recorder::Impl::State::recording, "the recorder is not recording");
  RTSTDB_ASSERT(pipeline.device == recorder.device && bindings.device == recorder.device,
                "the pipeline or the bindings are of another device");
  RTSTDB_ASSERT(bindings.letters == pipeline.letters,
                "the bindings are not of the form that the pipeline has");
  RTSTDB_ASSERT(push_constants.size() == pipeline.push_constant_bytes,
                "the push constants are not of the size that the shader has");
  if (!recorder.begun) return false;
  if (!compiled(pipeline)) {
    recorder.device->lost = true;
    return false;
  }
  const vk::raii::CommandBuffer& commands = recorder.commands;
  constexpr auto compute = vk::PipelineBindPoint::eCompute;
  commands.bindPipeline(compute, *pipeline.kernel->pipeline);
  if (!pipeline.letters.empty())
    commands.bindDescriptorSets(compute, *pipeline.kernel->layout, 0, *bindings.set, {});
  if (!push_constants.empty()) {
    commands.pushConstants<std::byte>(*pipeline.kernel->layout, vk::ShaderStageFlagBits::eCompute, 0,
                                      push_constants);
  }
  return true;
}

}  // namespace

Recorder::Impl::Impl(std::shared_ptr<Device::Impl> device_in)
    : device(std::move(device_in)),
      pool(device->device, vk::CommandPoolCreateInfo({}, device->queue_family)),
      commands(allocate_commands(device->device, *pool)),
      timestamps(device->device, vk::QueryPoolCreateInfo({}, vk::QueryType::eTimestamp, max_timestamps)) {}

Recorder::Impl::~Impl() {
  if (submitted_to) submitted_to->wait(number, std::numeric_limits<std::uint64_t>::max());
}

bool Recorder::Impl::finished() const noexcept {
  return !submitted_to || submitted_to->wait(number, 0) != WaitResult::timeout;
}

Result<Recorder> Device::create_recorder() {
  return impl_->attempt("a recorder can not be created", [&]() -> Result<Recorder> {
    Recorder recorder;
    recorder.impl_ = std::make_unique<Recorder::Impl>(impl_);
    return recorder;
  });
}

Recorder::Recorder() = default;
Recorder::~Recorder() = default;
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;

void Recorder::begin() {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->state != Impl::State::recording,
                "the recorder was moved from, or is recording already");
  RTSTDB_ASSERT(impl_->finished(), "the last submission of the recorder has not finished");
  impl_->state = Impl::State::recording;
  impl_->written_slots = 0;
  impl_->begun = false;
  const Device::Impl& device = *impl_->device;
  const VkCommandBufferBeginInfo options{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO, nullptr, 0, nullptr};
  const bool ok = device.vk().vkResetCommandPool(*device.device, *impl_->pool, 0) == VK_SUCCESS &&
                  device.vk().vkBeginCommandBuffer(*impl_->commands, &options) == VK_SUCCESS;
  if (!ok) {
    impl_->device->lost = true;
    return;
  }
  impl_->begun = true;
  order_work(impl_->commands);  // waits for the writes of earlier submissions
}

void Recorder::dispatch(const Pipeline& pipeline, const Bindings& bindings,
                        std::span<const std::byte> push_constants, std::uint32_t groups) {
  RTSTDB_ASSERT(impl_ != nullptr && pipeline.impl_ != nullptr && bindings.impl_ != nullptr,
                "the recorder, the pipeline or the bindings were moved from");
  RTSTDB_ASSERT(groups <= impl_->device->limits.max_groups, "the number of workgroups is above max_groups");
  if (groups == 0) return;
  if (bind_pipeline(*impl_, *pipeline.impl_, *bindings.impl_, push_constants))
    impl_->commands.dispatch(groups, 1, 1);
}

void Recorder::dispatch_indirect(const Pipeline& pipeline, const Bindings& bindings,
                                 std::span<const std::byte> push_constants, const Buffer& counts,
                                 std::size_t offset_bytes) {
  RTSTDB_ASSERT(
      impl_ != nullptr && pipeline.impl_ != nullptr && bindings.impl_ != nullptr && counts.impl_ != nullptr,
      "the recorder or one of the arguments was moved from");
  RTSTDB_ASSERT(counts.impl_->options.indirect && offset_bytes % sizeof(std::uint32_t) == 0,
                "the buffer is not for indirect dispatches, or the offset is not a multiple of 4");
  RTSTDB_ASSERT(in_range(*counts.impl_, offset_bytes, sizeof(VkDispatchIndirectCommand)),
                "the range goes beyond the end of the buffer");
  if (bind_pipeline(*impl_, *pipeline.impl_, *bindings.impl_, push_constants))
    impl_->commands.dispatchIndirect(*counts.impl_->buffer, offset_bytes);
}

void Recorder::barrier() {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->state == Impl::State::recording, "the recorder is not recording");
  if (impl_->begun) order_work(impl_->commands);
}

void Recorder::copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset,
                    std::size_t size_bytes) {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->state == Impl::State::recording, "the recorder is not recording");
  RTSTDB_ASSERT(from.impl_ != nullptr && to.impl_ != nullptr, "a buffer was moved from");
  RTSTDB_ASSERT(in_range(*from.impl_, from_offset, size_bytes) && in_range(*to.impl_, to_offset, size_bytes),
                "the range goes beyond the end of the buffer");
  if (size_bytes == 0 || !impl_->begun) return;
  impl_->commands.copyBuffer(*from.impl_->buffer, *to.impl_->buffer,
                             vk::BufferCopy(from_offset, to_offset, size_bytes));
}

void Recorder::fill(const Buffer& buffer, std::size_t offset_bytes, std::size_t size_bytes,
                    std::uint32_t word) {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->state == Impl::State::recording, "the recorder is not recording");
  RTSTDB_ASSERT(buffer.impl_ != nullptr && in_range(*buffer.impl_, offset_bytes, size_bytes),
                "the buffer was moved from, or the range goes beyond its end");
  RTSTDB_ASSERT(offset_bytes % sizeof(word) == 0 && size_bytes % sizeof(word) == 0,
                "the offset or the size is not a multiple of 4");
  if (size_bytes == 0 || !impl_->begun) return;
  impl_->commands.fillBuffer(*buffer.impl_->buffer, offset_bytes, size_bytes, word);
}

void Recorder::timestamp(std::uint32_t slot) {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->state == Impl::State::recording, "the recorder is not recording");
  RTSTDB_ASSERT(slot < max_timestamps && (impl_->written_slots >> slot & 1u) == 0,
                "the slot is not below max_timestamps, or has a timestamp already");
  impl_->written_slots |= 1u << slot;
  if (impl_->begun) impl_->commands.writeTimestamp2(Stage::eAllCommands, *impl_->timestamps, slot);
}

void Recorder::end() {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->state == Impl::State::recording, "the recorder is not recording");
  impl_->state = Impl::State::recorded;
  if (!impl_->begun) return;
  order(impl_->commands, Stage::eHost, Access::eHostRead);
  if (impl_->device->vk().vkEndCommandBuffer(*impl_->commands) != VK_SUCCESS) impl_->device->lost = true;
}

}  // namespace rtstdb::gpu
