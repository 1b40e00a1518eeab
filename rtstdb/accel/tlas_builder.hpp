#pragma once
// The tree of a TLAS too large for one workgroup: the passes that build a geometry's structure, over the boxes
// of instances, one a leaf (shaders/build/tree_*.glsl). Boxes of the tree's nodes come with the refit.
//
// Threads: one. create and bind are setup; the rest is the tick's and allocates nothing.

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

  enum PassIndex : std::size_t {
    centers_pass,
    codes_pass,
    leaves_pass,
    merge_pass,
    root_pass,
    count_pass,
    queue_pass,
  };
  static constexpr std::size_t pass_count = queue_pass + 1;
  /// The first ones read boxes.
  static constexpr std::size_t reading_pass_count = leaves_pass + 1;
  /// The passes connected to the instances' boxes and to the nodes that are to be made; and those that read boxes, to
  /// motion boxes.
  struct Bound {
    std::array<gpu::Bindings, pass_count> passes;
    std::array<gpu::Bindings, reading_pass_count> of_motion;
    RadixSort::Bound sort;
  };
  Result<Bound> bind(gpu::Device& device, const gpu::Buffer& bounds, const gpu::Buffer& motion_boxes,
                     const gpu::Buffer& nodes) const;

  /// Dispatches of every pass that build nothing.
  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;

  /// Slots and references of the tree over `count` instances, at least 1. The recorder is begun and holds the
  /// passes that made the instances' boxes; on return it has been submitted, once at the least, because the host has to know the
  /// levels. Puts the first node of each level and then the number of nodes into `levels`. False: the device was lost.
  bool run(std::uint32_t count, const Bound& bound, Submit& submit, std::vector<std::uint32_t>& levels);

  // The same in parts, over several submissions:
  //   begin, then record until recorded(), and a submission after that take_levels; from record on again where it says no.
  // Another build in between takes the scratch memory: then it has to be begun again.
  void begin(std::uint32_t count) noexcept;
  bool recorded() const noexcept { return stage_ == Stage::submission; }
  /// Of which a part was recorded last.
  bool is_within_pass() const noexcept {
    return next_ != 0 && stage_ != Stage::sort && stage_ != Stage::levels;
  }
  /// Records `most` work or a little more, or what is left of a pass; returns how much. `source`: whose motion boxes at the end of its
  /// window are the instances', or null: the bounds of `bound` are.
  std::uint64_t record(std::uint64_t most, const Bound* source, const Bound& bound, gpu::Recorder& recorder);
  bool take_levels(std::vector<std::uint32_t>& levels);
  /// All of it, in the weights of tlas_ahead.cpp; and how many passes that is.
  static std::uint64_t work(std::uint32_t count) noexcept;
  static std::uint32_t passes(std::uint32_t count) noexcept;

 private:
  enum class Stage : std::uint8_t { clear, centers, codes, sort, leaves, merge, root, levels, submission };
  void go_on_with(Stage stage) noexcept {
    stage_ = stage;
    next_ = 0;
  }
  /// Of a pass over the instances.
  std::uint64_t record_pass(PassIndex index, std::uint64_t most, Stage then, const Bound* source,
                            const Bound& bound, gpu::Recorder& recorder);
  void record_level(const Bound& bound, gpu::Recorder& recorder);
  shared::BlasArgs args() const noexcept;

  std::uint32_t capacity_ = 0;
  std::array<gpu::Pipeline, pass_count> pipelines_;
  RadixSort sort_;
  RadixSort::Words words_ = RadixSort::Words::upper;
  gpu::Buffer sorted_, low_words_, offsets_, tree_, binary_, arrivals_, queue_, children_, state_,
      state_readback_;

  // Of the build that was begun.
  std::uint32_t count_ = 0;
  Stage stage_ = Stage::clear;
  std::uint32_t next_ = 0;          // of what the stage goes through
  std::uint32_t levels_taken_ = 0;  // from submissions before
};

}  // namespace rtstdb::accel
