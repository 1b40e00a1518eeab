#pragma once
// Brings a few instances that changed into a TLAS that stands: their boxes and those of the nodes above them, in
// one dispatch (shaders/build/tlas_patch.comp). What it costs depends on how many changed, not on how many there
// are.
//
// Threads: one. create and bind are setup; record is the tick's and does not allocate.

#include <cstdint>
#include <span>

#include "rtstdb/gpu/device.hpp"
#include "shaders/shared/build.h"

namespace rtstdb::accel {

class TlasPatch {
 public:
  /// For trees of at most `instances` instances and `nodes` nodes.
  static Result<TlasPatch> create(gpu::Device& device, std::uint32_t instances, std::uint32_t nodes);

  /// What belongs to one tree.
  struct Bound {
    gpu::Buffer parents, stamps;
    gpu::Bindings parents_pass, patch_pass;
    std::uint32_t stamp = 0;  ///< of the last patch; 0: parents are to be found first
  };
  /// `places`: of instances, where those to be patched are listed.
  Result<void> bind(gpu::Device& device, const gpu::Buffer& nodes, const gpu::Buffer& motion_boxes,
                    const gpu::Buffer& places, Bound& bound) const;

  /// Dispatches of both passes that patch nothing.
  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;

  /// Where the children of these nodes hang in the tree that stands. The first patch of a tree sees to all of them where
  /// nobody has before.
  void find_parents(std::uint32_t first, std::uint32_t count, Bound& bound, gpu::Recorder& recorder) const;

  /// The first `listed` of the places, max_patched at the most, have new boxes, made by what was recorded before. `levels`: the first node of each level, then the
  /// number of nodes. Places from `visible_count` on are in no tree.
  void record(std::uint32_t listed, std::uint32_t visible_count, std::span<const std::uint32_t> levels,
              Bound& bound, gpu::Recorder& recorder) const;

 private:
  std::uint32_t instances_ = 0;
  std::uint32_t nodes_ = 0;
  gpu::Pipeline parents_, patch_;
  gpu::Buffer levels_, climbers_;
};

}  // namespace rtstdb::accel
