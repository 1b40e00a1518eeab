#pragma once
// Builds the BLAS of one geometry on the device: a binary tree over Morton codes, improved by tree rotations,
// then collapsed into nodes of up to 8 children and leaves of up to 4 triangles by the surface area
// heuristic. shaders/build/tree_scratch.glsl describes the buffers.
//
// Threads: one. All calls are setup calls, except a build within the capacity that keep_capacity() reserved.
// The result is bit for bit the same from run to run on one device.

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "rtstdb/accel/radix_sort.hpp"
#include "rtstdb/accel/submit.hpp"
#include "rtstdb/geometry/mesh_view.hpp"
#include "rtstdb/gpu/device.hpp"
#include "shaders/shared/blas.h"

namespace rtstdb::accel {

/// The device memory of one build.
class BlasScratch {
 public:
  /// For meshes of at most this many triangles and positions. Errors: capacity, out_of_memory, device_lost.
  static Result<BlasScratch> create(gpu::Device& device, std::uint32_t triangles, std::size_t positions);

  std::uint32_t capacity() const noexcept { return capacity_; }
  std::size_t positions_capacity() const noexcept { return positions_capacity_; }

  void upload(const MeshView& mesh) const;
  /// In the order of tree_scratch.glsl.
  std::array<const gpu::Buffer*, 11> bindings() const noexcept;
  Result<RadixSort::Bound> bind_sort(gpu::Device& device, const RadixSort& sort) const {
    return sort.bind(device, sorted_, low_words_, offsets_);
  }

  const gpu::Buffer& low_words() const noexcept { return low_words_; }
  const gpu::Buffer& tree() const noexcept { return tree_; }
  const gpu::Buffer& state() const noexcept { return state_; }
  const gpu::Buffer& state_readback() const noexcept { return state_readback_; }

 private:
  std::uint32_t capacity_ = 0;
  std::size_t positions_capacity_ = 0;
  gpu::Buffer positions_, corners_, sorted_, low_words_, offsets_, tree_, binary_, arrivals_, queue_,
      children_;
  gpu::Buffer state_, state_readback_;
};

class BlasBuilder {
 public:
  /// Upper bound on the entries of levels(): a binary tree is at most as deep as the bits of a Morton code
  /// and of a place together; one entry more marks the end.
  static constexpr std::size_t max_levels = 63 + 32 + 1;

  /// Creates the pipelines and dispatches each once without work, since drivers compile at the first
  /// dispatch. Errors: out_of_memory, device_lost.
  static Result<BlasBuilder> create(gpu::Device& device, Submit& submit);

  /// Where a structure is written in the pools, in their elements.
  struct Place {
    std::uint32_t node_base = 0;
    std::uint32_t leaf_base = 0;
  };
  /// Starts building the structure of a mesh that has passed validate() except for triangles without area.
  /// Reads the mesh inside this call only. Allocates memory only where has_capacity_for() returns false.
  /// Errors: capacity, out_of_memory, device_lost.
  Result<void> start_build(gpu::Device& device, const MeshView& mesh, Submit& submit);
  /// Waits for the build that start_build() began, and returns the number of its nodes. Error: device_lost.
  Result<std::uint32_t> finish_build(Submit& submit);
  /// start_build() and finish_build().
  Result<std::uint32_t> build(gpu::Device& device, const MeshView& mesh, Submit& submit);
  /// Writes the structure that was built last into the pools, which are large enough and `addressed`. May be
  /// called again for another place. False: the device is lost.
  bool write(const Place& place, const gpu::Buffer& nodes, const gpu::Buffer& triangles, Submit& submit);
  /// After write(): writes 16 bytes per triangle in leaf order, its corners and its index, to an `addressed`
  /// buffer.
  bool write_order(const gpu::Buffer& order, Submit& submit);
  /// After write(): the index of the triangle at each position of the leaf order, one word each.
  gpu::BufferPart leaf_order() const noexcept { return {&scratch_.low_words(), 0, 4 * std::size_t{count_}}; }
  /// Of the structure that was built last: the first node of each level, then the number of nodes. The nodes
  /// of a level follow those of the level above.
  std::span<const std::uint32_t> levels() const noexcept { return levels_; }

  /// From now on release() keeps memory for builds of this size; the last build had it.
  void keep_capacity(std::size_t triangles, std::size_t positions) noexcept {
    kept_triangles_ = std::max(kept_triangles_, triangles);
    kept_positions_ = std::max(kept_positions_, positions);
  }
  bool has_capacity_for(std::size_t triangles, std::size_t positions) const noexcept {
    return triangles <= scratch_.capacity() && positions <= scratch_.positions_capacity();
  }
  /// Allocates the memory to be kept, on a device where nothing has been built yet.
  Result<void> allocate_kept(gpu::Device& device) {
    return reserve(device, kept_triangles_, kept_positions_);
  }
  /// Frees memory that a large build took, down to the memory to be kept. If that can not be allocated,
  /// has_capacity_for() returns false from then on.
  void release(gpu::Device& device);

 private:
  enum PassIndex : std::size_t {
    centers_pass,
    codes_pass,
    leaves_pass,
    merge_pass,
    root_pass,
    count_pass,
    queue_pass,
    nodes_pass,
    triangles_pass,
    order_pass,
    pass_count,
  };
  struct Pass {
    gpu::Pipeline pipeline;
    gpu::Bindings bindings;
  };
  Result<void> reserve(gpu::Device& device, std::size_t triangles, std::size_t positions);
  Result<void> adopt(gpu::Device& device, BlasScratch scratch);
  shared::BlasArgs args_of_build() const noexcept;
  void dispatch(PassIndex pass, const shared::BlasArgs& args, std::uint32_t groups, Submit& submit) const;
  void record_tree(RadixSort::Words words, Submit& submit) const;
  void record_levels(Submit& submit) const;
  bool append_levels(std::span<const std::uint32_t> state);
  void record_continuation(gpu::Recorder& recorder) const;

  std::array<Pass, pass_count> passes_;
  RadixSort sort_;
  RadixSort::Bound sort_bound_;
  BlasScratch scratch_;
  std::uint32_t count_ = 0;       // triangles of the last build
  std::uint32_t node_count_ = 0;  // and its nodes
  std::vector<std::uint32_t> levels_;
  std::size_t kept_triangles_ = 0, kept_positions_ = 0;
};

}  // namespace rtstdb::accel
