#include <algorithm>
#include <utility>

#include "rtstdb/gpu/buffer_impl.hpp"
#include "rtstdb/gpu/pipeline_impl.hpp"
#include "rtstdb/gpu/raster_impl.hpp"

namespace rtstdb::gpu {
namespace {

/// A pool that holds exactly one descriptor set with these bindings.
vk::raii::DescriptorPool create_pool(const vk::raii::Device& device, std::string_view letters) {
  std::vector<vk::DescriptorPoolSize> sizes;
  for (const char letter : letters)
    sizes.emplace_back(descriptor_type(letter), 1);
  return {device,
          vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, sizes)};
}

const vk::raii::BufferView& view_of(const Buffer::Impl& buffer, char letter) {
  const vk::raii::BufferView& view = letter == 'F' ? buffer.texel_float4 : buffer.texel_uint4;
  RTSTDB_ASSERT(*view != vk::BufferView{} && (letter != 'I' || buffer.options.texel_image),
                "the buffer has no view of the type that the shader reads");
  return view;
}

/// A BufferPart with its size resolved.
struct Part {
  const Buffer::Impl* buffer;
  std::size_t offset;
  std::size_t size;
};

void write_set(const vk::raii::Device& device, vk::DescriptorSet set, std::string_view letters,
               std::span<const Part> parts) {
  std::vector<vk::DescriptorBufferInfo> ranges(letters.size());
  std::vector<vk::BufferView> views(letters.size());
  std::vector<vk::WriteDescriptorSet> writes;
  for (std::uint32_t i = 0; i < letters.size(); ++i) {
    vk::WriteDescriptorSet write(set, i, 0, 1, descriptor_type(letters[i]));
    if (letters[i] == 'S') {
      ranges[i] = vk::DescriptorBufferInfo(*parts[i].buffer->buffer, parts[i].offset, parts[i].size);
      write.pBufferInfo = &ranges[i];
    } else {
      views[i] = *view_of(*parts[i].buffer, letters[i]);
      write.pTexelBufferView = &views[i];
    }
    writes.push_back(write);
  }
  device.updateDescriptorSets(writes, {});
}

std::vector<BufferPart> whole(std::span<const Buffer* const> buffers) {
  std::vector<BufferPart> parts;
  for (const Buffer* buffer : buffers)
    parts.push_back({.buffer = buffer});
  return parts;
}

}  // namespace

/// The bindings that a pipeline of either kind has.
struct Device::BindingPlan {
  std::string letters;
  vk::DescriptorSetLayout set_layout;
  std::string name;
};

Result<Bindings> Device::create_bindings(const Pipeline& pipeline, std::span<const Buffer* const> buffers) {
  return create_bindings(pipeline, whole(buffers));
}

Result<Bindings> Device::create_bindings(const Pipeline& pipeline, std::span<const BufferPart> buffers) {
  RTSTDB_ASSERT(pipeline.impl_ != nullptr, "the pipeline was moved from");
  const Pipeline::Impl& of = *pipeline.impl_;
  return create_bindings({of.letters, *of.kernel->set_layout, of.kernel->name}, buffers);
}

Result<Bindings> Device::create_bindings(const RasterPipeline& pipeline,
                                         std::span<const Buffer* const> buffers) {
  RTSTDB_ASSERT(pipeline.impl_ != nullptr, "the pipeline was moved from");
  const RasterPipeline::Impl& of = *pipeline.impl_;
  return create_bindings({of.letters, *of.set_layout, "a raster pipeline"}, whole(buffers));
}

Result<Bindings> Device::create_bindings(const BindingPlan& of, std::span<const BufferPart> buffers) {
  RTSTDB_ASSERT(buffers.size() == of.letters.size(),
                "the number of buffers is not that of the bindings of the shader");
  std::vector<Part> parts;
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    RTSTDB_ASSERT(buffers[i].buffer != nullptr && buffers[i].buffer->impl_ != nullptr,
                  "a buffer is null or was moved from");
    const Buffer::Impl& buffer = *buffers[i].buffer->impl_;
    const std::size_t offset = buffers[i].offset_bytes;
    const std::size_t all = buffer.options.size_bytes;
    RTSTDB_ASSERT(buffer.device == impl_ && offset < all && offset % limits().storage_alignment_bytes == 0,
                  "a buffer is of another device, or its part begins beyond its end or is not aligned");
    const std::size_t size = buffers[i].size_bytes != 0 ? buffers[i].size_bytes : all - offset;
    RTSTDB_ASSERT(size <= all - offset, "a part goes beyond the end of its buffer");
    if (of.letters[i] == 'S' && size > limits().max_storage_range_bytes) {
      return Error{ErrorCode::capacity, "buffer \"" + buffer.options.name + "\" of " + std::to_string(size) +
                                            " bytes exceeds the limit of " +
                                            std::to_string(limits().max_storage_range_bytes) +
                                            " bytes in one storage binding on " + info().name};
    }
    parts.push_back({&buffer, offset, size});
  }
  return impl_->attempt("bindings of " + of.name + " can not be created", [&]() -> Result<Bindings> {
    Bindings bindings;
    bindings.impl_ = std::make_unique<Bindings::Impl>(Bindings::Impl{.device = impl_, .letters = of.letters});
    if (of.letters.empty()) return bindings;
    bindings.impl_->pool = create_pool(impl_->device, of.letters);
    const vk::DescriptorSetAllocateInfo one(*bindings.impl_->pool, of.set_layout);
    bindings.impl_->set = std::move(vk::raii::DescriptorSets(impl_->device, one).front());
    write_set(impl_->device, *bindings.impl_->set, of.letters, parts);
    return bindings;
  });
}

Bindings::Bindings() = default;
Bindings::~Bindings() = default;
Bindings::Bindings(Bindings&&) noexcept = default;
Bindings& Bindings::operator=(Bindings&&) noexcept = default;

}  // namespace rtstdb::gpu
