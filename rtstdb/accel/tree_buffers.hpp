#pragma once
// Buffers of the tree builders that passes load as texels, for n primitives
// (shaders/build/tree_scratch.glsl).

#include <cstddef>
#include <string>
#include <utility>

#include "rtstdb/gpu/device.hpp"

namespace rtstdb::accel {

/// Four texels per inner node and two per leaf. Passes also write it by address.
inline gpu::BufferOptions tree_buffer(std::string name, std::size_t primitives) {
  return {.name = std::move(name),
          .size_bytes = 16 * 6 * primitives,
          .texel_uint4 = true,
          .texel_image = true,
          .addressed = true};
}

/// Two inner nodes per texel, an even number of nodes.
inline gpu::BufferOptions binary_buffer(std::string name, std::size_t primitives) {
  return {.name = std::move(name), .size_bytes = 16 * (primitives / 2), .texel_uint4 = true};
}

}  // namespace rtstdb::accel
