#pragma once
// Ranks memory types for a buffer. Free of Vulkan types, so that unit tests cover unified memory (lavapipe)
// as well as separate device memory, host memory and a host-visible window of device memory.

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
  bool special = false;  ///< protected, lazily allocated or similar: never used for buffers
};

/// Returns the indices of the types that can hold such a buffer, best first. Bit i of `allowed_bits` allows
/// type i. Of equally good types the lower index comes first, which is the driver's order of preference.
std::vector<std::uint32_t> rank_memory_types(std::span<const MemoryTraits> types, std::uint32_t allowed_bits,
                                             Memory memory);

}  // namespace rtstdb::gpu
