#pragma once
// Builds the tree of a TLAS that is too large for one workgroup. It runs the passes of the BLAS build over
// the boxes of instances, with one instance per leaf (shaders/build/tree_*.glsl). A refit then computes the
// boxes of the nodes.
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
  /// For trees of at most `capacity` instances. Errors: out_of_memory, device_lost.
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
  /// The number of passes that read boxes; they come first.
  static constexpr std::size_t reading_pass_count = leaves_pass + 1;
  /// The passes bound to the boxes of instances and to the output nodes; the passes that read boxes are also
  /// bound to motion boxes.
  struct Bound {
    std::array<gpu::Bindings, pass_count> passes;
    std::array<gpu::Bindings, reading_pass_count> of_motion;
    RadixSort::Bound sort;
  };
  Result<Bound> bind(gpu::Device& device, const gpu::Buffer& bounds, const gpu::Buffer& motion_boxes,
                     const gpu::Buffer& nodes) const;

  /// Records an empty dispatch of every pass.
  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;

  /// Builds slots and references of the tree over `count` (at least 1) instances. The recorder of `submit`
  /// has begun and holds the passes that compute the instances' boxes. On return it has been submitted at
  /// least once, because the host must know the levels. `levels` receives the first node of each level and
  /// then the number of nodes. False: the device is lost.
  bool run(std::uint32_t count, const Bound& bound, Submit& submit, std::vector<std::uint32_t>& levels);

  // The same build in parts that span several submissions:
  //   begin(), record() until recorded(), then a submission, then take_levels();
  //   if that returns false, record() again.
  // A run() in between uses the same scratch memory, so the build must then begin again.
  void begin(std::uint32_t count) noexcept;
  bool recorded() const noexcept { return stage_ == Stage::submission; }
  /// Whether the last record() ended inside a pass.
  bool is_within_pass() const noexcept {
    return next_ != 0 && stage_ != Stage::sort && stage_ != Stage::levels;
  }
  /// Records about `most` work, at most the rest of a pass. Returns the recorded work. `source`: take the
  /// instances' boxes from its motion boxes at the end of the window; null: from the bounds of `bound`.
  std::uint64_t record(std::uint64_t most, const Bound* source, const Bound& bound, gpu::Recorder& recorder);
  bool take_levels(std::vector<std::uint32_t>& levels);
  /// The total work in the weights of tlas_next_slot.cpp, and the number of passes.
  static std::uint64_t work(std::uint32_t count) noexcept;
  static std::uint32_t passes(std::uint32_t count) noexcept;

 private:
  enum class Stage : std::uint8_t { clear, centers, codes, sort, leaves, merge, root, levels, submission };
  void go_on_with(Stage stage) noexcept {
    stage_ = stage;
    next_ = 0;
  }
  /// A pass over the instances.
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

  // Of the build in progress.
  std::uint32_t count_ = 0;
  Stage stage_ = Stage::clear;
  std::uint32_t next_ = 0;          // first element that the current stage has not processed
  std::uint32_t levels_taken_ = 0;  // from earlier submissions
};

}  // namespace rtstdb::accel
