#pragma once
// Updates an existing TLAS after a few instances changed: recomputes their boxes and those of the nodes above
// them, in one dispatch (shaders/build/tlas_patch.comp). The cost depends on the number of changed instances,
// not on the size of the tree.
//
// Threads: one. create and bind are setup; record is the tick's and does not allocate.

#include <cstdint>
#include <span>

#include "rtstdb/gpu/device.hpp"
#include "shaders/shared/build.h"

namespace rtstdb::accel {

class TlasPatch {
 public:
  /// For trees of at most this many instances and nodes. Errors: out_of_memory, device_lost.
  static Result<TlasPatch> create(gpu::Device& device, std::uint32_t instances, std::uint32_t nodes);

  /// The state that belongs to one tree.
  struct Bound {
    gpu::Buffer parents, stamps;
    gpu::Bindings parents_pass, patch_pass;
    std::uint32_t stamp = 0;  ///< of the last patch; 0: find_parents() has to come first
  };
  /// `places` lists the positions of the instances to patch.
  Result<void> bind(gpu::Device& device, const gpu::Buffer& nodes, const gpu::Buffer& motion_boxes,
                    const gpu::Buffer& places, Bound& bound) const;

  /// Records an empty dispatch of both passes.
  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;

  /// Records the parents of the children of these nodes. The first patch of a tree does this for all nodes
  /// unless it has been done.
  void find_parents(std::uint32_t first, std::uint32_t count, Bound& bound, gpu::Recorder& recorder) const;

  /// The first `listed` (at most max_patched) entries of `places` have new boxes, computed by commands
  /// recorded before. `levels` holds the first node of each level, then the number of nodes. Places from
  /// `visible_count` on are not in the tree.
  void record(std::uint32_t listed, std::uint32_t visible_count, std::span<const std::uint32_t> levels,
              Bound& bound, gpu::Recorder& recorder) const;

 private:
  std::uint32_t instances_ = 0;
  std::uint32_t nodes_ = 0;
  gpu::Pipeline parents_, patch_;
  gpu::Buffer levels_, climbers_;
};

}  // namespace rtstdb::accel
