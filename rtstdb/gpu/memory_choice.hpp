#pragma once
// Which memory types suit a buffer, apart from Vulkan so that it can be tried on machines that are not at
// hand: one type for everything (unified memory, lavapipe), or device memory, host memory and a window
// between them.

#include <cstdint>
#include <span>
#include <vector>

#include "rtstdb/gpu/device.hpp"

namespace rtstdb::gpu {

struct MemoryTraits {
  bool device_local = false;
  bool host_visible = false;
  bool host_coherent = false;
  bool host_cached = false;
  bool special = false;  ///< protected, lazily allocated or the like: never for plain buffers
};

/// The indices of `types` that may hold a buffer of this kind, best first; `allowed_bits` has a bit per
/// index. Equal merit: the lower index, which is the driver's own order of preference.
std::vector<std::uint32_t> rank_memory_types(std::span<const MemoryTraits> types, std::uint32_t allowed_bits,
                                             Memory memory);

}  // namespace rtstdb::gpu
