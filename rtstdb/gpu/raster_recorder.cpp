// The commands of a recorder that draw.

#include "rtstdb/gpu/buffer_impl.hpp"
#include "rtstdb/gpu/pipeline_impl.hpp"
#include "rtstdb/gpu/raster_impl.hpp"
#include "rtstdb/gpu/recorder_impl.hpp"

namespace rtstdb::gpu {
namespace {

using RasterStage = vk::PipelineStageFlagBits2;
using RasterAccess = vk::AccessFlagBits2;

constexpr vk::PipelineStageFlags2 words_stage = RasterStage::eColorAttachmentOutput;
constexpr vk::PipelineStageFlags2 depth_stages =
    RasterStage::eEarlyFragmentTests | RasterStage::eLateFragmentTests;

/// Passes an image from one use to the next. Its contents before a draw are discarded.
void change_layout(const vk::raii::CommandBuffer& commands, const Attachment& attachment,
                   vk::ImageAspectFlagBits aspect, bool to_draw) {
  const bool is_depth = aspect == vk::ImageAspectFlagBits::eDepth;
  const vk::PipelineStageFlags2 draw_stages = is_depth ? depth_stages : words_stage;
  const vk::AccessFlags2 writes =
      is_depth ? RasterAccess::eDepthStencilAttachmentWrite : RasterAccess::eColorAttachmentWrite;
  const vk::AccessFlags2 reads =
      is_depth ? RasterAccess::eDepthStencilAttachmentRead : RasterAccess::eColorAttachmentRead;
  const vk::ImageLayout drawn =
      is_depth ? vk::ImageLayout::eDepthAttachmentOptimal : vk::ImageLayout::eColorAttachmentOptimal;
  const vk::ImageSubresourceRange range(aspect, 0, 1, 0, 1);
  const vk::ImageMemoryBarrier2 barrier =
      to_draw ? vk::ImageMemoryBarrier2(RasterStage::eAllTransfer | draw_stages, writes, draw_stages,
                                        reads | writes, vk::ImageLayout::eUndefined, drawn,
                                        VK_QUEUE_FAMILY_IGNORED, VK_QUEUE_FAMILY_IGNORED, *attachment.image,
                                        range)
              : vk::ImageMemoryBarrier2(draw_stages, writes, RasterStage::eAllTransfer,
                                        RasterAccess::eTransferRead, drawn,
                                        vk::ImageLayout::eTransferSrcOptimal, VK_QUEUE_FAMILY_IGNORED,
                                        VK_QUEUE_FAMILY_IGNORED, *attachment.image, range);
  commands.pipelineBarrier2(vk::DependencyInfo({}, {}, {}, barrier));
}

void copy_attachment(const vk::raii::CommandBuffer& commands, const Attachment& attachment,
                     vk::ImageAspectFlagBits aspect, const RasterTargetOptions& options,
                     const Buffer::Impl& to, std::size_t offset_bytes) {
  const vk::BufferImageCopy region(offset_bytes, 0, 0, vk::ImageSubresourceLayers(aspect, 0, 0, 1), {0, 0, 0},
                                   {options.width, options.height, 1});
  commands.copyImageToBuffer(*attachment.image, vk::ImageLayout::eTransferSrcOptimal, *to.buffer, region);
}

}  // namespace

void Recorder::draw(const RasterPipeline& pipeline, const Bindings& bindings,
                    std::span<const std::byte> push_constants, const RasterTarget& target,
                    const Buffer& commands, std::uint32_t count) {
  RTSTDB_ASSERT(impl_ != nullptr && pipeline.impl_ != nullptr && bindings.impl_ != nullptr &&
                    target.impl_ != nullptr && commands.impl_ != nullptr,
                "the recorder or one of the arguments was moved from");
  const RasterPipeline::Impl& with = *pipeline.impl_;
  const RasterTarget::Impl& into = *target.impl_;
  RTSTDB_ASSERT(impl_->state == Impl::State::recording, "the recorder is not recording");
  RTSTDB_ASSERT(with.device == impl_->device && into.device == impl_->device,
                "the pipeline or the target is of another device");
  RTSTDB_ASSERT(bindings.impl_->letters == with.letters && with.has_words == into.options.words,
                "the bindings or the target are not of the form that the pipeline has");
  RTSTDB_ASSERT(push_constants.size() == with.push_constant_bytes,
                "the push constants are not of the size that the shader has");
  RTSTDB_ASSERT(commands.impl_->options.indirect &&
                    std::size_t{count} * sizeof(DrawCommand) <= commands.impl_->options.size_bytes,
                "the buffer is not for indirect draws, or is smaller than the commands");
  if (!impl_->begun) return;
  const vk::raii::CommandBuffer& to = impl_->commands;
  change_layout(to, into.depth, vk::ImageAspectFlagBits::eDepth, true);
  if (into.options.words) change_layout(to, into.words, vk::ImageAspectFlagBits::eColor, true);
  constexpr std::uint32_t nothing = 0xFFFFFFFFu;
  const vk::RenderingAttachmentInfo words(
      *into.words.view, vk::ImageLayout::eColorAttachmentOptimal, {}, {}, {}, vk::AttachmentLoadOp::eClear,
      vk::AttachmentStoreOp::eStore,
      vk::ClearValue(vk::ClearColorValue(std::array<std::uint32_t, 4>{nothing, nothing, 0, 0})));
  const vk::RenderingAttachmentInfo depth(*into.depth.view, vk::ImageLayout::eDepthAttachmentOptimal, {}, {},
                                          {}, vk::AttachmentLoadOp::eClear, vk::AttachmentStoreOp::eStore,
                                          vk::ClearValue(vk::ClearDepthStencilValue(0.0f, 0)));
  const vk::Rect2D area({0, 0}, {into.options.width, into.options.height});
  vk::RenderingInfo rendering;
  rendering.setRenderArea(area).setLayerCount(1).setPDepthAttachment(&depth);
  if (into.options.words) rendering.setColorAttachments(words);
  to.beginRendering(rendering);
  to.bindPipeline(vk::PipelineBindPoint::eGraphics, *with.pipeline);
  to.setViewport(0, vk::Viewport(0.0f, 0.0f, static_cast<float>(into.options.width),
                                 static_cast<float>(into.options.height), 0.0f, 1.0f));
  to.setScissor(0, area);
  if (!with.letters.empty())
    to.bindDescriptorSets(vk::PipelineBindPoint::eGraphics, *with.layout, 0, *bindings.impl_->set, {});
  if (!push_constants.empty())
    to.pushConstants<std::byte>(*with.layout, vk::ShaderStageFlagBits::eVertex, 0, push_constants);
  to.drawIndirect(*commands.impl_->buffer, 0, count, sizeof(DrawCommand));
  to.endRendering();
  change_layout(to, into.depth, vk::ImageAspectFlagBits::eDepth, false);
  if (into.options.words) change_layout(to, into.words, vk::ImageAspectFlagBits::eColor, false);
}

void Recorder::copy_words(const RasterTarget& target, const Buffer& to, std::size_t offset_bytes) {
  RTSTDB_ASSERT(impl_ != nullptr && target.impl_ != nullptr && to.impl_ != nullptr,
                "the recorder, the target or the buffer was moved from");
  const RasterTargetOptions& options = target.impl_->options;
  RTSTDB_ASSERT(options.words && impl_->state == Impl::State::recording,
                "the target has no words, or the recorder is not recording");
  RTSTDB_ASSERT(
      offset_bytes + std::size_t{options.width} * options.height * 8 <= to.impl_->options.size_bytes,
      "the range goes beyond the end of the buffer");
  if (impl_->begun)
    copy_attachment(impl_->commands, target.impl_->words, vk::ImageAspectFlagBits::eColor, options, *to.impl_,
                    offset_bytes);
}

void Recorder::copy_depth(const RasterTarget& target, const Buffer& to, std::size_t offset_bytes) {
  RTSTDB_ASSERT(impl_ != nullptr && target.impl_ != nullptr && to.impl_ != nullptr,
                "the recorder, the target or the buffer was moved from");
  const RasterTargetOptions& options = target.impl_->options;
  RTSTDB_ASSERT(impl_->state == Impl::State::recording, "the recorder is not recording");
  RTSTDB_ASSERT(offset_bytes + std::size_t{options.width} * options.height * sizeof(float) <=
                    to.impl_->options.size_bytes,
                "the range goes beyond the end of the buffer");
  if (impl_->begun)
    copy_attachment(impl_->commands, target.impl_->depth, vk::ImageAspectFlagBits::eDepth, options, *to.impl_,
                    offset_bytes);
}

}  // namespace rtstdb::gpu
