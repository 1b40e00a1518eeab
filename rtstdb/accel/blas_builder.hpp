#pragma once
// Builds the structure of one geometry: a binary tree over Morton codes, rotated where that makes boxes
// smaller, then nodes of up to 8 children and leaves of up to 4 triangles as the surface area says.
// shaders/build/tree_scratch.glsl tells what each buffer holds.
//
// Threads: one. Setup, but for building again what it was told to keep room for. The same bits from run to run on one device.

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

/// The memory of one build.
class BlasScratch {
 public:
  /// For at most so many triangles and positions.
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
  /// Levels that any tree can have (of a binary one: the bits of a code and those of a place), and the end behind them.
  static constexpr std::size_t max_levels = 63 + 32 + 1;

  /// Drivers compile at the first dispatch: done in here.
  static Result<BlasBuilder> create(gpu::Device& device, Submit& submit);

  /// Where a structure will stand in the pools.
  struct Place {
    std::uint32_t node_base = 0;
    std::uint32_t leaf_base = 0;
  };
  /// Sets out to decide on the structure of a mesh that has passed validate but for triangles without area. The mesh is
  /// read here alone. Allocates only where has_room_for says no. Errors: capacity, out_of_memory, device_lost.
  Result<void> start_build(gpu::Device& device, const MeshView& mesh, Submit& submit);
  /// After start_build, whose device works meanwhile: how many nodes the structure has. Error: device_lost.
  Result<std::uint32_t> finish_build(Submit& submit);
  /// Both.
  Result<std::uint32_t> build(gpu::Device& device, const MeshView& mesh, Submit& submit);
  /// Writes the structure that was built last into the pools, which have room for it and are addressed; again for another
  /// place. False: the device is lost.
  bool write(const Place& place, const gpu::Buffer& nodes, const gpu::Buffer& triangles, Submit& submit);
  /// After write, to an addressed buffer: 16 bytes for each triangle in the order of the leaves, its corners and its own number.
  bool write_order(const gpu::Buffer& order, Submit& submit);
  /// After write: the number of the triangle at each place in the order of the leaves, a word each.
  gpu::BufferPart leaf_order() const noexcept { return {&scratch_.low_words(), 0, 4 * std::size_t{count_}}; }
  /// Of the structure that was built last: the first node of each level, then the number of nodes. Nodes of a level
  /// follow those of the level above.
  std::span<const std::uint32_t> levels() const noexcept { return levels_; }

  /// The memory of the last build, of so many, is kept from now on.
  void keep_room_for(std::size_t triangles, std::size_t positions) noexcept {
    kept_triangles_ = std::max(kept_triangles_, triangles);
    kept_positions_ = std::max(kept_positions_, positions);
  }
  bool has_room_for(std::size_t triangles, std::size_t positions) const noexcept {
    return triangles <= scratch_.capacity() && positions <= scratch_.positions_capacity();
  }
  /// Takes the memory that is to be kept, on a device where nothing has been built yet.
  Result<void> take_kept_room(gpu::Device& device) {
    return reserve(device, kept_triangles_, kept_positions_);
  }
  /// Gives back what a large build took. What was to be kept may then be missing, where memory has run out:
  /// has_room_for says so.
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
  bool note_levels(std::span<const std::uint32_t> state);
  void record_where_to_go_on(gpu::Recorder& recorder) const;

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
