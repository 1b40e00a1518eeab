#pragma once
// Scratch memory for a small tree, which one workgroup builds in one dispatch
// (shaders/build/tlas_small.comp). shaders/build/scratch.glsl describes the buffers.
//
// Threads: one. Setup.

#include <array>

#include "rtstdb/gpu/device.hpp"
#include "shaders/shared/build.h"

namespace rtstdb::accel {

/// Upper bound on the number of wide nodes of a structure. A node with fewer than 8 children has only leaves
/// as children, each of which stands for more than max_leaf primitives at the node above. Counting edges
/// gives W <= n/7 + n/(m+1) * (7-m)/7, plus 2 for rounding.
std::uint32_t wide_node_bound(std::uint32_t primitives, std::uint32_t max_leaf) noexcept;

class BuildScratch {
 public:
  /// For builds of at most small_build_max primitives.
  static Result<BuildScratch> create(gpu::Device& device);

  /// Number of elements in one half of the collapse queue.
  static constexpr std::uint32_t half_size = shared::small_build_max;

  /// Bindings 0 to 9 in the order of scratch.glsl.
  static constexpr std::size_t binding_count = 10;
  std::array<const gpu::Buffer*, binding_count> bindings(const gpu::Buffer& bounds,
                                                         const gpu::Buffer& nodes) const noexcept;

 private:
  gpu::Buffer keys_, values_, binary_, parents_, node_bounds_, arrivals_, queue_, offsets_;
};

}  // namespace rtstdb::accel
