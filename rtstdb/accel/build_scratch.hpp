#pragma once
// Scratch memory of one structure build and the passes that every build shares: Morton codes, radix sort,
// binary tree, fit, collapse to wide nodes. shaders/build/scratch.glsl says what each buffer holds.

#include <array>
#include <optional>
#include <string>

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
  static Result<LargeBuild> create(gpu::Device& device);
  /// Connects to a scratch and a node pool; again whenever either was made anew.
  Result<void> bind(gpu::Device& device, const BuildScratch& scratch, const gpu::Buffer& node_pool);

  /// Dispatches of every pass that build nothing.
  void record_warm_up(gpu::Recorder& recorder) const;

  struct Task {
    std::uint32_t count = 0;  ///< primitives, at least 1
    std::uint32_t max_leaf = 1;
    std::uint32_t leaf_bits = 0;  ///< or-ed into leaf references
    std::uint32_t leaf_base = 0;
    std::uint32_t node_base = 0;
  };
  /// `recorder` is begun and holds the passes that made the boxes; on return it has been submitted. Gives the
  /// number of wide nodes, or nothing when the device was lost.
  std::optional<std::uint32_t> run(const Task& task, const BuildScratch& scratch, Submit& submit);

 private:
  struct Pass {
    gpu::Pipeline pipeline;
    gpu::Bindings bindings;
  };
  void sort(const shared::BuildArgs& args, gpu::Recorder& recorder) const;
  std::array<Pass, 9> passes_;
};

}  // namespace rtstdb::accel
