#pragma once
// Scratch memory of one small tree, which one workgroup builds in one dispatch (shaders/build/tlas_small.comp).
// shaders/build/scratch.glsl says what each buffer holds.
//
// Threads: one. Setup.

#include <array>

#include "rtstdb/gpu/device.hpp"
#include "shaders/shared/build.h"

namespace rtstdb::accel {

/// The most wide nodes that a structure of `primitives` can have. A node with fewer than 8 children has
/// leaves only, each below more than max_leaf primitives: from counting edges, W <= n/7 + n/(m+1) * (7-m)/7
/// (+2 for rounding).
std::uint32_t wide_node_bound(std::uint32_t primitives, std::uint32_t max_leaf) noexcept;

class BuildScratch {
 public:
  /// For builds of at most small_build_max primitives.
  static Result<BuildScratch> create(gpu::Device& device);

  /// Elements in one half of the queue.
  static constexpr std::uint32_t half_size = shared::small_build_max;

  /// Bindings 0 to 9 in the order of scratch.glsl.
  static constexpr std::size_t binding_count = 10;
  std::array<const gpu::Buffer*, binding_count> bindings(const gpu::Buffer& bounds,
                                                         const gpu::Buffer& nodes) const noexcept;

 private:
  gpu::Buffer keys_, values_, binary_, parents_, node_bounds_, arrivals_, queue_, offsets_;
};

}  // namespace rtstdb::accel
