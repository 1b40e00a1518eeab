#include "rtstdb/gpu/memory_choice.hpp"

#include <algorithm>

namespace rtstdb::gpu {
namespace {

bool fits(const MemoryTraits& type, Memory memory) {
  if (type.special) return false;
  return memory == Memory::device || (type.host_visible && type.host_coherent);
}

/// Higher is better.
int merit(const MemoryTraits& type, Memory memory) {
  switch (memory) {
    case Memory::device:
      // Host-visible device memory is a small window on many devices: keep it free for buffers that need it.
      return (type.device_local ? 2 : 0) + (type.host_visible ? 0 : 1);
    case Memory::upload:
      // Shaders read in place; the host only writes.
      return (type.device_local ? 2 : 0) + (type.host_cached ? 0 : 1);
    case Memory::readback:
      // Host reads of uncached memory are the slowest access of all.
      return (type.host_cached ? 2 : 0) + (type.device_local ? 0 : 1);
  }
  return 0;
}

}  // namespace

std::vector<std::uint32_t> rank_memory_types(std::span<const MemoryTraits> types, std::uint32_t allowed_bits,
                                             Memory memory) {
  std::vector<std::uint32_t> ranked;
  for (std::uint32_t i = 0; i < types.size(); ++i) {
    if ((allowed_bits >> i & 1u) != 0 && fits(types[i], memory)) ranked.push_back(i);
  }
  std::stable_sort(ranked.begin(), ranked.end(), [&](std::uint32_t a, std::uint32_t b) {
    return merit(types[a], memory) > merit(types[b], memory);
  });
  return ranked;
}

}  // namespace rtstdb::gpu
