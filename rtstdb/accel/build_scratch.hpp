#pragma once
// Scratch memory of one structure build and the passes that every build shares: Morton codes, radix sort,
// binary tree, fit, collapse to wide nodes. shaders/build/scratch.glsl says what each buffer holds.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "rtstdb/accel/radix_sort.hpp"
#include "rtstdb/accel/submit.hpp"
#include "rtstdb/gpu/device.hpp"
#include "shaders/shared/build.h"

namespace rtstdb::accel {

/// The most wide nodes that a structure of `primitives` can have. A node with fewer than 8 children has
/// leaves only, each below more than max_leaf primitives: from counting edges, W <= n/7 + n/(m+1) * (7-m)/7
/// (+2 for rounding).
std::uint32_t wide_node_bound(std::uint32_t primitives, std::uint32_t max_leaf) noexcept;

class BuildScratch {
 public:
  /// For builds of at most `primitives`. The node pool is bound as the builder's output.
  static Result<BuildScratch> create(gpu::Device& device, std::uint32_t primitives, const std::string& name);

  std::uint32_t capacity() const noexcept { return capacity_; }
  /// Elements in one half of the ping-pong buffers.
  std::uint32_t half_size() const noexcept { return capacity_; }

  /// Bindings 0 to 10 in the order of scratch.glsl.
  static constexpr std::size_t binding_count = 11;
  std::array<const gpu::Buffer*, binding_count> bindings(const gpu::Buffer& node_pool) const noexcept;
  Result<RadixSort::Bound> bind_sort(gpu::Device& device, const RadixSort& sort) const {
    return sort.bind(device, keys_, values_, offsets_);
  }
  const gpu::Buffer& state_readback() const noexcept { return state_readback_; }
  const gpu::Buffer& state() const noexcept { return state_; }
  const gpu::Buffer& queue() const noexcept { return queue_; }

 private:
  std::uint32_t capacity_ = 0;
  gpu::Buffer bounds_, keys_, values_, binary_, parents_, node_bounds_, arrivals_, queue_, offsets_, state_;
  gpu::Buffer state_readback_;
};

/// The passes after the primitives' boxes are known, for structures too large for one workgroup. Setup and
/// large scenes: it submits several times, because the host has to see how many nodes each level of the
/// collapse has.
class LargeBuild {
 public:
  static constexpr std::size_t pass_count = 7;
  static Result<LargeBuild> create(gpu::Device& device);
  /// The passes connected to a scratch and to the nodes that are to be made.
  struct Bound {
    std::array<gpu::Bindings, pass_count> passes;
    RadixSort::Bound sort;
  };
  Result<Bound> bind(gpu::Device& device, const BuildScratch& scratch, const gpu::Buffer& nodes) const;

  /// Dispatches of every pass that build nothing.
  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;

  /// The tree over `count` primitives, at least 1, but for the boxes of its wide nodes. The recorder is begun
  /// and holds the passes that made the primitives' boxes; on return it has been submitted. Puts the first
  /// node of each level and then the number of nodes into `levels`. False: the device was lost.
  bool run(std::uint32_t count, const Bound& bound, const BuildScratch& scratch, Submit& submit,
           std::vector<std::uint32_t>& levels) const;

 private:
  std::array<gpu::Pipeline, pass_count> pipelines_;
  RadixSort sort_;
};

}  // namespace rtstdb::accel
