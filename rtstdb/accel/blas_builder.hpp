#pragma once
// Builds the structure of one geometry: a binary tree over Morton codes, rotated where that makes boxes
// smaller, then nodes of up to 8 children and leaves of up to 4 triangles as the surface area says.
// shaders/build/blas_scratch.glsl tells what each buffer holds.
//
// Threads: one. Setup. The same bits from run to run on one device.

#include <array>
#include <string>
#include <utility>

#include <rtstdb/geometry.hpp>

#include "rtstdb/accel/radix_sort.hpp"
#include "rtstdb/accel/submit.hpp"
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
  std::uint32_t nodes_at_once() const noexcept { return nodes_at_once_; }
  std::uint32_t triangles_at_once() const noexcept { return triangles_at_once_; }

  void upload(const TriangleMesh& mesh) const;
  /// In the order of blas_scratch.glsl.
  std::array<const gpu::Buffer*, 16> bindings() const noexcept;
  Result<RadixSort::Bound> bind_sort(gpu::Device& device, const RadixSort& sort) const {
    return sort.bind(device, keys_, values_, offsets_);
  }

  const gpu::Buffer& state() const noexcept { return state_; }
  const gpu::Buffer& state_readback() const noexcept { return state_readback_; }
  const gpu::Buffer& wide() const noexcept { return wide_; }
  const gpu::Buffer& triangles() const noexcept { return triangles_; }

 private:
  std::uint32_t capacity_ = 0, nodes_at_once_ = 0, triangles_at_once_ = 0;
  std::size_t positions_capacity_ = 0;
  gpu::Buffer positions_, corners_, keys_, values_, offsets_, box_lo_, box_hi_, binary_;
  gpu::Buffer arrivals_, costs_, queue_, children_, state_, wide_, triangles_, state_readback_;
};

class BlasBuilder {
 public:
  /// Drivers compile at the first dispatch: done in here.
  static Result<BlasBuilder> create(gpu::Device& device, Submit& submit);

  /// Where a structure will stand in the pools.
  struct Place {
    std::uint32_t node_base = 0;
    std::uint32_t leaf_base = 0;
  };
  /// Decides on the structure of a mesh that has passed validate, and says how many nodes it has. Errors:
  /// capacity, out_of_memory, device_lost.
  Result<std::uint32_t> build(gpu::Device& device, const TriangleMesh& mesh, Submit& submit);
  /// Writes the structure that was built last into the pools, which have room for it. False: the device is
  /// lost.
  bool write(const Place& place, const gpu::Buffer& nodes, const gpu::Buffer& triangles, Submit& submit);

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
    pass_count,
  };
  struct Pass {
    gpu::Pipeline pipeline;
    gpu::Bindings bindings;
  };
  Result<void> reserve(gpu::Device& device, const TriangleMesh& mesh);
  Result<void> adopt(gpu::Device& device, BlasScratch scratch);
  void dispatch(PassIndex pass, const shared::BlasArgs& args, std::uint32_t groups, Submit& submit) const;
  void record_levels(Submit& submit) const;

  std::array<Pass, pass_count> passes_;
  RadixSort sort_;
  RadixSort::Bound sort_bound_;
  BlasScratch scratch_;
  std::uint32_t count_ = 0;       // triangles of the last build
  std::uint32_t node_count_ = 0;  // and its nodes
};

}  // namespace rtstdb::accel
