#include "rtstdb/gpu/host_memory.hpp"

namespace rtstdb::gpu {
namespace {

constexpr std::size_t whole_pages(std::size_t size_bytes) {
  return (size_bytes + HostMemory::page_bytes - 1) / HostMemory::page_bytes * HostMemory::page_bytes;
}

}  // namespace

HostMemory::HostMemory(std::size_t size_bytes)
    : start_(static_cast<std::byte*>(::operator new (whole_pages(size_bytes), std::align_val_t{page_bytes}))),
      size_bytes_(size_bytes) {}

std::span<std::byte> HostMemory::pages() const noexcept {
  return {start_.get(), whole_pages(size_bytes_)};
}

}  // namespace rtstdb::gpu
