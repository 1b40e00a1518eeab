#pragma once
// The tree of a TLAS too large for one workgroup: the passes that build a geometry's structure, over the boxes
// of instances, one a leaf (shaders/build/tree_*.glsl). Boxes of the tree's nodes come with the refit.
//
// Threads: one. create and bind are setup; run is the tick's, allocates nothing and waits for the device at
// least once, because the host has to know the levels.

#include <array>
#include <vector>

#include "rtstdb/accel/radix_sort.hpp"
#include "rtstdb/accel/submit.hpp"
#include "rtstdb/gpu/device.hpp"
#include "shaders/shared/blas.h"

namespace rtstdb::accel {

class TlasBuilder {
 public:
  /// For trees of at most `capacity` instances.
  static Result<TlasBuilder> create(gpu::Device& device, std::uint32_t capacity);

  static constexpr std::size_t pass_count = 7;
  /// The passes connected to the instances' boxes and to the nodes that are to be made.
  struct Bound {
    std::array<gpu::Bindings, pass_count> passes;
    RadixSort::Bound sort;
  };
  Result<Bound> bind(gpu::Device& device, const gpu::Buffer& bounds, const gpu::Buffer& nodes) const;

  /// Dispatches of every pass that build nothing.
  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;

  /// Slots and references of the tree over `count` instances, at least 1. The recorder is begun and holds the
  /// passes that made the instances' boxes; on return it has been submitted. Puts the first node of each level
  /// and then the number of nodes into `levels`. False: the device was lost.
  bool run(std::uint32_t count, const Bound& bound, Submit& submit, std::vector<std::uint32_t>& levels);

 private:
  void record_tree(const shared::BlasArgs& args, RadixSort::Words words, const Bound& bound,
                   gpu::Recorder& recorder) const;
  void record_levels(shared::BlasArgs args, std::uint32_t levels, const Bound& bound,
                     gpu::Recorder& recorder) const;

  std::uint32_t capacity_ = 0;
  std::array<gpu::Pipeline, pass_count> pipelines_;
  RadixSort sort_;
  RadixSort::Words words_ = RadixSort::Words::upper;
  gpu::Buffer keys_, values_, offsets_, box_lo_, box_hi_, binary_, arrivals_, costs_, queue_, children_;
  gpu::Buffer state_, state_readback_;
};

}  // namespace rtstdb::accel
