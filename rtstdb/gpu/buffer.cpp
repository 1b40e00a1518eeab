#include <cstring>
#include <optional>
#include <utility>

#include "rtstdb/gpu/buffer_impl.hpp"

namespace rtstdb::gpu {
namespace {

constexpr std::size_t texel_bytes = 16;

vk::BufferUsageFlags usage_of(const BufferOptions& options) {
  using Usage = vk::BufferUsageFlagBits;
  vk::BufferUsageFlags usage = Usage::eStorageBuffer | Usage::eTransferSrc | Usage::eTransferDst;
  if (options.texel_uint4 || options.texel_float4) usage |= Usage::eUniformTexelBuffer;
  if (options.texel_image) usage |= Usage::eStorageTexelBuffer;
  if (options.indirect) usage |= Usage::eIndirectBuffer;
  if (options.addressed) usage |= Usage::eShaderDeviceAddress;
  return usage;
}

/// Describes the limit that the buffer exceeds; empty when it exceeds none.
std::optional<std::string> exceeded_limit(const Device::Impl& device, const BufferOptions& options) {
  const auto sentence = [&](std::size_t limit, const char* of_what) {
    return "buffer \"" + options.name + "\" of " + std::to_string(options.size_bytes) +
           " bytes exceeds the limit of " + std::to_string(limit) + " " + of_what + " on " + device.info.name;
  };
  if (options.size_bytes > device.limits.max_allocation_bytes) {
    return sentence(device.limits.max_allocation_bytes, "bytes in one allocation");
  }
  const bool texels = options.texel_uint4 || options.texel_float4;
  if (texels && options.size_bytes / texel_bytes > device.limits.max_texel_elements) {
    return sentence(device.limits.max_texel_elements, "texels in one view");
  }
  if (device.allocations >= device.max_allocations) return sentence(device.max_allocations, "allocations");
  return std::nullopt;
}

vk::MemoryAllocateFlagsInfo flags_of(const BufferOptions& options) {
  return {options.addressed ? vk::MemoryAllocateFlagBits::eDeviceAddress : vk::MemoryAllocateFlags{}};
}

/// Imports the caller's pages as the buffer's memory. Returns null when the device can not import them.
vk::raii::DeviceMemory import_host_memory(const Device::Impl& device, const vk::MemoryRequirements& needs,
                                          const BufferOptions& options) try {
  constexpr auto type = vk::ExternalMemoryHandleTypeFlagBits::eHostAllocationEXT;
  const std::span<std::byte> pages = options.host->pages();
  if (needs.size > pages.size()) return nullptr;
  const auto possible = device.device.getMemoryHostPointerPropertiesEXT(type, pages.data());
  const auto types = rank_memory_types(device.memory_types, needs.memoryTypeBits & possible.memoryTypeBits,
                                       Memory::readback);
  if (types.empty()) return nullptr;
  const vk::MemoryAllocateFlagsInfo flags = flags_of(options);
  const vk::ImportMemoryHostPointerInfoEXT import(type, pages.data(), &flags);
  vk::MemoryAllocateInfo wanted(pages.size(), types.front());
  wanted.pNext = &import;
  return {device.device, wanted};
} catch (const vk::OutOfDeviceMemoryError&) {
  return nullptr;
} catch (const vk::InvalidExternalHandleError&) {
  return nullptr;
}

}  // namespace

Buffer::Impl::Impl(std::shared_ptr<Device::Impl> device_in, const BufferOptions& options_in)
    : device(std::move(device_in)), options(options_in), allocation(*device) {
  const vk::raii::Device& d = device->device;
  const bool tries_import = options.host != nullptr && device->imports_host_memory;
  vk::BufferCreateInfo wanted({}, options.size_bytes, usage_of(options));
  const vk::ExternalMemoryBufferCreateInfo external(vk::ExternalMemoryHandleTypeFlagBits::eHostAllocationEXT);
  if (tries_import) wanted.pNext = &external;
  buffer = vk::raii::Buffer(d, wanted);
  device->name(vk::ObjectType::eBuffer, reinterpret_cast<std::uint64_t>(static_cast<VkBuffer>(*buffer)),
               options.name);
  const vk::MemoryRequirements needs = buffer.getMemoryRequirements();
  if (tries_import) memory = import_host_memory(*device, needs, options);
  const bool imported = *memory != vk::DeviceMemory{};
  if (!imported) {
    const vk::MemoryAllocateFlagsInfo flags = flags_of(options);
    memory = device->allocate(needs, options.memory, &flags);
  }
  buffer.bindMemory(*memory, 0);
  if (options.addressed) address = d.getBufferAddress(vk::BufferDeviceAddressInfo(*buffer));
  const auto view = [&](vk::Format format) {
    return vk::raii::BufferView(d, vk::BufferViewCreateInfo({}, *buffer, format, 0, VK_WHOLE_SIZE));
  };
  if (options.texel_uint4) texel_uint4 = view(vk::Format::eR32G32B32A32Uint);
  if (options.texel_float4) texel_float4 = view(vk::Format::eR32G32B32A32Sfloat);
  if (imported) {
    mapped = options.host->pages().data();
  } else if (options.memory != Memory::device) {
    mapped = static_cast<std::byte*>(memory.mapMemory(0, VK_WHOLE_SIZE));
    if (options.host != nullptr) host_copy = options.host->pages().data();
  }
}

Result<Buffer> Device::create_buffer(const BufferOptions& options) {
  const bool texels = options.texel_uint4 || options.texel_float4;
  RTSTDB_ASSERT(options.size_bytes != 0, "the buffer has no bytes");
  RTSTDB_ASSERT(!texels || options.size_bytes % texel_bytes == 0,
                "the size is not a multiple of that of a texel");
  RTSTDB_ASSERT(options.host == nullptr ||
                    (options.memory != Memory::device && options.host->size_bytes() >= options.size_bytes),
                "the host memory is smaller than the buffer, or the buffer is in device memory");
  if (const auto limit = exceeded_limit(*impl_, options)) return Error{ErrorCode::capacity, *limit};
  const std::string what = "buffer \"" + options.name + "\" of " + std::to_string(options.size_bytes) +
                           " bytes can not be created";
  return impl_->attempt(what, [&]() -> Result<Buffer> {
    Buffer buffer;
    buffer.impl_ = std::make_unique<Buffer::Impl>(impl_, options);
    return buffer;
  });
}

Result<void> Device::create_buffers(std::span<const BufferRequest> wanted) {
  for (const auto& [buffer, options] : wanted) {
    auto made = create_buffer(options);
    if (!made) return made.error();
    *buffer = std::move(made).value();
  }
  return {};
}

Buffer::Buffer() = default;
Buffer::~Buffer() = default;
Buffer::Buffer(Buffer&&) noexcept = default;
Buffer& Buffer::operator=(Buffer&&) noexcept = default;

std::size_t Buffer::size_bytes() const noexcept {
  return impl_ ? impl_->options.size_bytes : 0;
}

std::span<std::byte> Buffer::host() const noexcept {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->mapped != nullptr,
                "the buffer was moved from, or its memory is not mapped");
  return {impl_->host_copy != nullptr ? impl_->host_copy : impl_->mapped, impl_->options.size_bytes};
}

glm::uvec2 Buffer::address(std::size_t offset_bytes) const noexcept {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->options.addressed && offset_bytes < impl_->options.size_bytes,
                "the buffer was moved from or has no address, or the offset is beyond its end");
  const std::uint64_t address = impl_->address + offset_bytes;
  return {static_cast<std::uint32_t>(address), static_cast<std::uint32_t>(address >> 32)};
}

void Buffer::flush(std::size_t offset_bytes, std::size_t size_bytes) const noexcept {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->options.host != nullptr,
                "the buffer was moved from, or has no host memory");
  RTSTDB_ASSERT(offset_bytes + size_bytes <= impl_->options.size_bytes,
                "the range goes beyond the end of the buffer");
  if (impl_->host_copy == nullptr || size_bytes == 0) return;
  std::memcpy(impl_->mapped + offset_bytes, impl_->host_copy + offset_bytes, size_bytes);
}

void Buffer::invalidate(std::size_t offset_bytes, std::size_t size_bytes) const noexcept {
  RTSTDB_ASSERT(impl_ != nullptr && impl_->options.host != nullptr,
                "the buffer was moved from, or has no host memory");
  RTSTDB_ASSERT(offset_bytes + size_bytes <= impl_->options.size_bytes,
                "the range goes beyond the end of the buffer");
  if (impl_->host_copy == nullptr || size_bytes == 0) return;
  std::memcpy(impl_->host_copy + offset_bytes, impl_->mapped + offset_bytes, size_bytes);
}

}  // namespace rtstdb::gpu
