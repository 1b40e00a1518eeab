#pragma once
// The base of every query kind on the GPU. It holds what all kinds share: pipelines and bindings, buffers on
// the device and their loss, the order of a batch, stages, retries of incomplete elements, and the slots of
// the answers. A kind says what it needs on a device, checks and packs its elements, records its dispatches
// and unpacks the answers.
//
// Terms. An element is one query of a batch. A place is an element's position in the order in which the
// device searches the batch. A part is a range of places that one chunk searches. A stage is a pass over all
// places that begins when the one before it is complete: most kinds have one.
//
// Threads: the engine thread, but for join, leave and what they call.

#include <glm/vec2.hpp>

#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/answer_slots.hpp"
#include "rtstdb/query/appearance.hpp"
#include "rtstdb/query/dispatch_layout.hpp"
#include "rtstdb/query/executor.hpp"
#include "rtstdb/query/prepared_queries.hpp"
#include "rtstdb/threads/fork_join.hpp"

namespace rtstdb::query {

/// Where a dispatch reads that it must start no further elements (shaders/common/halt.glsl).
struct HaltAt {
  glm::uvec2 words{0};     ///< address of the HaltWords of its chunk; zero: it is never halted
  std::uint32_t from = 0;  ///< number in the chunk of the element at place 0; may wrap
};

/// What one chunk searches of a query's batch.
struct BatchPart {
  PlaceRange range;       ///< of the stage's places; of the retried places when is_retry
  bool is_retry = false;  ///< elements that the first pass left incomplete
  std::uint32_t stage = 0;
};

/// The version that a batch queries, on the host.
struct BatchWorld {
  const RowSource& rows;
  const accel::GeometryPool& pool;
  const Appearance& appearance;
};

/// What a dispatch is recorded with.
struct Recording {
  const RowSource& rows;
  const accel::GeometryPool& pool;
  const accel::Tlas& tlas;
  const accel::TlasView& view;
  HaltAt halt;
  gpu::Recorder& recorder;
};

/// A kernel variant with its bindings, one per slot of the TLAS.
struct Kernel {
  gpu::ShaderId shader{};
  std::vector<std::byte> idle_arguments;
  gpu::Pipeline pipeline;
  std::vector<gpu::Bindings> bindings;
};

/// A kernel variant that a query needs. `idle_arguments`: push constants with which it searches nothing.
struct KernelNeed {
  gpu::ShaderId shader{};
  std::vector<std::byte> idle_arguments;
};

template <class Args>
KernelNeed kernel_need(gpu::ShaderId shader, const Args& idle) {
  const auto bytes = std::as_bytes(std::span(&idle, 1));
  return {shader, {bytes.begin(), bytes.end()}};
}

/// What a query needs on a device. Each buffer goes where its BufferRequest says.
struct DeviceNeeds {
  std::vector<KernelNeed> kernels;
  std::vector<gpu::BufferRequest> buffers;
};

class GpuQuery : public PreparedQuery {
 public:
  // ---- setup: the executor calls these

  /// Creates everything that the query needs on the device; spans that callers hold stay valid. Errors:
  /// capacity, out_of_memory, device_lost: then it may be called again.
  Result<void> move_to(gpu::Device& device);
  /// Destroys everything that the query has on its device. Until move_to, nothing else may be called.
  void leave_device() noexcept;
  /// Binds the kernels to the pool and the slots; again whenever the pool's generation has changed.
  Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas);
  /// Records a dispatch of each kernel that searches nothing: drivers compile a kernel at its first dispatch.
  void record_warm_up(gpu::Recorder& recorder) noexcept;
  /// Adds the query to `queries` until leave(). `fork_join`: for long loops of check and unpack.
  void join(std::shared_ptr<PreparedQueries> queries, threads::ForkJoin& fork_join) {
    fork_join_ = &fork_join;
    queries_ = std::move(queries);
    queries_->join(*this);
  }

  // ---- a run: the executor calls these

  /// Begins a batch of the first `count` elements, which have passed check, in the order that suits the
  /// device.
  void begin_batch(std::uint32_t count, const BatchWorld& world) noexcept;
  /// Places of the stage that runs.
  std::uint32_t places() const noexcept { return places_; }
  std::uint32_t stage() const noexcept { return stage_; }
  /// Begins the next stage that has places. False: the batch has no such stage. Between passes.
  bool begin_next_stage(const BatchWorld& world) noexcept;
  /// How many incomplete places the next pass searches again; 0: none is left. Between passes. On lavapipe
  /// the elements of a group share one limit of work, so whether an element completes in the first pass
  /// depends on its neighbours in the batch; a retried element has a limit of its own.
  virtual std::uint32_t next_retry_batch() noexcept;
  /// This many retried elements take the device about as long as one.
  virtual std::uint32_t min_retry_batch() const noexcept { return groups_at_once(limits_.processors); }
  /// About how many places of one stage take the device as long as one element in all stages.
  virtual double places_per_element() const noexcept { return 1.0; }
  /// Packs the part's elements and records the dispatches that search them. Parts begin at multiples of
  /// `neighbours`. Two parts may be in flight, whose views may differ in everything but the version.
  virtual void record(const BatchPart& part, const Recording& recording) noexcept = 0;
  /// Moves the part's answers to where the caller reads them. Where the part was halted, it ends before the
  /// first element that was not started.
  void take_answers(const BatchPart& part, const accel::TlasView& view) noexcept;

  // ---- PreparedQuery

  std::uint32_t capacity() const noexcept final { return capacity_; }
  std::uint32_t answered() const noexcept final { return answered_; }
  std::uint32_t incomplete(std::uint32_t answered) const noexcept override;
  bool has_retries() const noexcept final;
  bool truncated() const noexcept final { return some_overflow_ || incomplete(answered_) > 0; }
  void publish_answers(std::uint32_t answered, std::uint32_t count) noexcept final;
  void discard_answers() noexcept final { slots_.discard(); }

  // ---- the executor's notes

  std::uint32_t epoch = 0;  ///< the device epoch that the query is on; 0: none
  std::uint32_t bound_generation = 0;
  bool bound = false;
  std::uint32_t retry_batch = 0;  ///< places of the retry pass that runs

 protected:
  /// `max_places`: of a stage whose places note_incomplete may be called for; 0: capacity.
  GpuQuery(std::uint32_t capacity, LatePolicy late, std::uint32_t max_places = 0)
      : PreparedQuery(late),
        slots_(late),
        capacity_(capacity),
        max_places_(max_places != 0 ? max_places : capacity) {}

  // ---- what a kind implements, beside check and kind of PreparedQuery

  /// Kernels and buffers; called for each device that the query comes to.
  virtual DeviceNeeds device_needs(const gpu::DeviceLimits& limits) = 0;
  /// The buffers of a kernel's bindings, in their order; may be more than the kernel has.
  virtual std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                        const accel::GeometryPool& pool,
                                                        const accel::Tlas& tlas) const = 0;
  /// See take_answers. Calls note_incomplete for each place that the search left incomplete, unless the part
  /// is a retry.
  virtual void unpack(const BatchPart& part, const accel::TlasView& view) noexcept = 0;
  /// Whether the written answer at a place is incomplete.
  virtual bool is_incomplete(std::uint32_t place) const noexcept = 0;
  /// Writes an incomplete answer at a place that has none.
  virtual void mark_incomplete(std::uint32_t place) noexcept = 0;

  // ---- what a kind may implement

  /// Fills buffers that were just created.
  virtual void initialize_buffers() noexcept {}
  /// For kinds that need more of a device than kernels and buffers. create_more ends move_to, bind_more ends
  /// bind, destroy_more begins leave_device, and record_more_warm_up ends record_warm_up.
  virtual Result<void> create_more(gpu::Device& /*device*/) { return {}; }
  virtual Result<void> bind_more(gpu::Device& /*device*/, const accel::GeometryPool& /*pool*/,
                                 const accel::Tlas& /*tlas*/) {
    return {};
  }
  virtual void destroy_more() noexcept {}
  virtual void record_more_warm_up(gpu::Recorder& /*recorder*/) noexcept {}
  /// A batch begins: puts its first `count` elements in order. Default: each element's place is its number.
  virtual void order_batch(std::uint32_t /*count*/) noexcept {}
  /// Begins the first stage and returns how many places it has. Default: one for each element.
  virtual std::uint32_t begin_first_stage(std::uint32_t count, const BatchWorld& /*world*/) noexcept {
    order_batch(count);
    return count;
  }
  /// Stages of the batch.
  virtual std::uint32_t stages() const noexcept { return 1; }
  /// With several stages: how many of the batch's `count` elements are answered once this one is complete.
  virtual std::uint32_t answered_after(std::uint32_t stage, std::uint32_t count) const noexcept {
    return stage + 1 >= stages() ? count : 0;
  }
  /// Begins stage 1 or a later one and returns how many places it has. Between stages other runs may rebuild
  /// the slot: a stage that uses places of an earlier view compares TlasView::contents.
  virtual std::uint32_t begin_stage(std::uint32_t /*stage*/, const BatchWorld& /*world*/) noexcept {
    return 0;
  }

  // ---- what a kind uses

  void note_incomplete(std::uint32_t place) noexcept { incomplete_.push_back(place); }
  void note_overflow() noexcept { some_overflow_ = true; }
  /// The stage's place that entry `i` of a part means.
  std::uint32_t place_at(const BatchPart& part, std::uint32_t i) const noexcept {
    return part.is_retry ? incomplete_[settled_ + i] : i;
  }
  /// The places of the retry pass that runs, ascending.
  std::span<const std::uint32_t> retry_places() const noexcept {
    return std::span(incomplete_).subspan(settled_, window_);
  }
  /// Takes the next `limit` incomplete places, at most, into the next retry pass.
  std::uint32_t advance_retries(std::uint32_t limit) noexcept;
  /// A retried search may go on in the next retry pass: it has not ended when a part of the pass is unpacked.
  void let_retries_pause() noexcept { retries_pause_ = true; }
  const gpu::DeviceLimits& limits() const noexcept { return limits_; }
  const AnswerSlots& slots() const noexcept { return slots_; }
  threads::ForkJoin& fork_join() const noexcept { return *fork_join_; }

  std::size_t kernel_count() const noexcept { return kernels_.size(); }
  const Kernel& kernel(std::size_t index) const noexcept { return kernels_[index]; }  ///< as in device_needs
  /// Dispatches in pieces, where the device takes fewer groups at once; `args.first` is set for each.
  template <class Args>
  void dispatch(const Kernel& kernel, const Recording& recording, const DispatchLayout& layout,
                const Args& args) const noexcept {
    in_pieces(layout, limits_.max_groups, args, [&](const Args& piece, std::uint32_t groups) {
      recording.recorder.dispatch(kernel.pipeline, kernel.bindings[recording.view.slot], piece, groups);
    });
  }

  /// Every final class calls this first in its destructor, so that no transaction binds a query that is half
  /// destroyed.
  void leave() noexcept {
    if (queries_) queries_->leave(*this);
  }

 private:
  bool is_last_stage() const noexcept { return stage_ + 1 >= stages(); }

  AnswerSlots slots_;
  std::uint32_t capacity_ = 0, max_places_ = 0;
  gpu::DeviceLimits limits_;
  std::vector<Kernel> kernels_;
  std::vector<gpu::Buffer*> buffers_;  // of the kind, on the device

  std::uint32_t count_ = 0;  // elements of the batch
  std::uint32_t stage_ = 0, places_ = 0;
  std::uint32_t answered_ = 0;
  bool some_overflow_ = false;
  bool retries_pause_ = false;
  std::vector<std::uint32_t> incomplete_;  // places of the stage; capacity for all
  std::uint32_t settled_ = 0;              // of them, those that no retry pass searches any more
  std::uint32_t window_ = 0;               // behind those, what the retry pass that runs searches
  std::uint32_t retried_ = 0;              // of the window, unpacked

  std::shared_ptr<PreparedQueries> queries_;
  threads::ForkJoin* fork_join_ = nullptr;
};

/// Dispatches a part: all of its places together, or each retried one alone.
template <class Args, class Dispatch>
void dispatch_places(const BatchPart& part, std::span<const std::uint32_t> retried, Args args,
                     const HaltAt& halt, std::uint32_t processors, const Dispatch& dispatch) noexcept {
  args.halt = halt.words;
  args.loop_probe = 2 /* two rounds, see loops_still_turn */;
  if (!part.is_retry) {
    const DispatchLayout layout = spread_out(part.range.end - part.range.first, processors);
    args.first = part.range.first;
    args.end = part.range.end;
    args.per_group = layout.per_group;
    args.halt_from = halt.from;
    dispatch(layout, args);
    return;
  }
  for (std::uint32_t i = part.range.first; i < part.range.end; ++i) {
    args.first = retried[i];
    args.end = retried[i] + 1;
    args.per_group = 1;
    args.halt_from = halt.from + i - retried[i];
    dispatch(one_a_group(1), args);
  }
}

}  // namespace rtstdb::query
