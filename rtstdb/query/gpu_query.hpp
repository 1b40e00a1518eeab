#pragma once
// A prepared query as the GPU executor sees it: pack what the caller filled in, record its dispatch, unpack
// the answers.

#include <glm/vec2.hpp>

#include <memory>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/dispatch_layout.hpp"
#include "rtstdb/query/executor.hpp"
#include "rtstdb/query/prepared_queries.hpp"
#include "rtstdb/threads/fork_join.hpp"

namespace rtstdb::query {

/// How a dispatch learns that it is to begin with no more elements (shaders/common/halt.glsl).
struct HaltAt {
  glm::uvec2 words{0};     ///< address of the HaltWords of its chunk; zero: it is never halted
  std::uint32_t from = 0;  ///< number in the chunk of the element at place 0; may wrap
};

class GpuQuery : public PreparedQuery {
 public:
  /// Makes all that it has on a device anew, there; what callers hold spans of stays where it is. Setup. Errors:
  /// capacity, out_of_memory, device_lost: then it may be asked again.
  virtual Result<void> move_to(gpu::Device& device) = 0;
  /// Lets go of all that it has on a device; misuse to ask it anything then before move_to.
  virtual void leave_device() noexcept = 0;
  /// Connects to the pool and the slots; again whenever the pool's generation changed. Setup.
  virtual Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool,
                            const accel::Tlas& tlas) = 0;
  /// A dispatch that answers nothing, on the first slot: drivers compile at the first dispatch.
  virtual void record_warm_up(gpu::Recorder& recorder) noexcept = 0;
  /// A batch of the first `count` elements, which have passed check, begins: brings them into the order that suits the
  /// device. Places count in that order from here on.
  virtual void begin_batch(std::uint32_t count) noexcept = 0;
  /// The elements at these places to device form, and the dispatch that answers them. Ranges of a batch begin at
  /// multiples of neighbours; two of them may be under way at a time, and their views may differ in all but the
  /// version.
  virtual void record(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas,
                      const accel::TlasView& view, const HaltAt& halt, gpu::Recorder& recorder) noexcept = 0;
  /// Answers to the caller's span. Where it was halted, of the range that was recorded those before the first that is left.
  virtual void unpack(PlaceRange range, const accel::TlasView& view) noexcept = 0;

  // On lavapipe the elements of a group share one allowance of work, so that whether an element finishes
  // could depend on its neighbours in the batch. Those left incomplete are asked again, in one pass after the other, once
  // the whole batch is unpacked.
  /// How many the next pass asks; none: nothing is to be asked again any more. Between passes.
  virtual std::uint32_t next_retry_batch() noexcept = 0;
  /// So many of them take the device no longer than one.
  virtual std::uint32_t min_retry_batch() const noexcept = 0;
  /// Of those, these. Halted as in record, if it can be.
  virtual void record_again(PlaceRange range, const RowSource& rows, const accel::Tlas& tlas,
                            const accel::TlasView& view, const HaltAt& halt,
                            gpu::Recorder& recorder) noexcept = 0;
  virtual void unpack_again(PlaceRange range, const accel::TlasView& view) noexcept = 0;

  /// Setup. From then on it is one of `queries`, until leave. `fork_join`: for long loops of check and unpack.
  void join(std::shared_ptr<PreparedQueries> queries, threads::ForkJoin& fork_join) {
    fork_join_ = &fork_join;
    queries_ = std::move(queries);
    queries_->join(*this);
  }

  // The executor's notes.
  std::uint32_t epoch = 0;  ///< where it is; 0: on no device
  std::uint32_t bound_generation = 0;
  bool bound = false;
  std::uint32_t asked_again = 0;  ///< by the pass under way

 protected:
  /// The first thing that the destructor of every query does: nobody may connect one that is half gone.
  void leave() noexcept {
    if (queries_) queries_->leave(*this);
  }
  threads::ForkJoin& fork_join() const noexcept { return *fork_join_; }

 private:
  std::shared_ptr<PreparedQueries> queries_;
  threads::ForkJoin* fork_join_ = nullptr;
};

}  // namespace rtstdb::query
