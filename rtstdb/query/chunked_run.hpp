#pragma once
// One run of the executor: brings the structures to the version, then executes the batches in chunks. Two
// chunks are in flight at a time, so that the device does not idle between them. After each chunk is a
// preemption point, where nested runs may execute.
//
// A nested run halts the chunk that is still in flight. A chunk that takes longer than predicted is halted
// when a preemption point is requested. The elements that a halted chunk did not start belong to the next
// chunk.
//
// Threads: the engine's.

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/chunk_pace.hpp"
#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {

/// What all runs share.
struct Structures {
  gpu::Device& device;
  accel::GeometryPool& pool;
  accel::Tlas& tlas;
  const Appearance* appearance = nullptr;
  std::uint64_t runs =
      0;  ///< begun so far; where it grew, another run may have taken a slot or a shape's place
};

/// The submissions of one run; chunks take them in turn.
using Lanes = std::array<accel::Submit, 2>;

class ChunkedRun {
 public:
  ChunkedRun(Structures& structures, Lanes& lanes, const RowSource& rows, std::span<const Request> requests,
             const TimeSpan& times, ExecutorCallbacks* callbacks) noexcept
      : structures_(structures),
        lanes_(lanes),
        rows_(rows),
        requests_(requests),
        times_(times),
        callbacks_(callbacks),
        pace_(chunk_ns()),
        halt_after_(usual_halt_after()) {}

  /// Executes the run. Nothing of other runs is in flight, since this writes what the device reads.
  RunReport run() noexcept;

 private:
  /// Of the device time of a run, at most 1 / repeated_divisor may be spent on elements that are executed
  /// again because of halts.
  static constexpr std::int64_t repeated_divisor = 5;

  BatchWorld world() const noexcept { return {rows_, structures_.pool, *structures_.appearance}; }

  enum class Pass : std::uint8_t { all, again };
  /// A position before an element of a request; the end is {number of requests, 0}.
  struct Cursor {
    std::size_t request = 0;
    std::uint32_t element = 0;
  };
  struct Chunk {
    Cursor begin, end;
    std::uint32_t elements = 0;
    bool halted = false;        // it ended before its elements were complete
    double predicted_ns = 0.0;  // 0: no sample of the cost, structures are brought up in the same submission
  };

  /// Begins the lane's recorder and records what brings the structures to the version. False: the device is
  /// lost.
  bool bring_up(accel::Submit& lane) noexcept;
  /// The status with which the run ends; none: all chunks of the pass are complete.
  std::optional<RunStatus> run_pass(Pass pass) noexcept;
  /// Calls on_preemption_point. What a later pass or stage goes on with stays as it is during nested runs.
  ExecutorCallbacks::Continuation offer_preemption_point(Pass pass) noexcept;
  /// All passes that search incomplete elements again.
  std::optional<RunStatus> next_retry_batch() noexcept;
  /// The next stage of every query that has one. False: there is none.
  bool begin_next_stage() noexcept;
  /// Before each retry pass and each later stage.
  std::optional<RunStatus> preemption_point_between_passes() noexcept;
  /// The preemption point between two chunks of a pass. `next_lane` is the lane of the next chunk, if
  /// `has_next`; `lane_in_flight` that of the chunk `in_flight`.
  std::optional<RunStatus> preemption_point(accel::Submit& next_lane, bool has_next,
                                            accel::Submit& lane_in_flight, std::optional<Chunk>& in_flight,
                                            Pass pass) noexcept;
  Chunk take(Cursor& next, Pass pass) const noexcept;
  /// Waits until the lane's chunk is complete or halted; a halted one is cut. `behind`: the submission after
  /// it, which is halted with it; may be null. False: the device is lost.
  bool finish(accel::Submit& lane, Chunk& chunk, Pass pass, accel::Submit* behind) noexcept;
  /// The chunk ends before its element `first_unstarted`.
  void cut(Chunk& chunk, std::uint32_t first_unstarted, Pass pass) noexcept;
  /// After a chunk of `submitted` elements was halted and cut: where none was completed, the next one gets
  /// more time and fewer elements.
  void follow_halt(const Chunk& chunk, std::uint32_t submitted) noexcept;
  void update_estimates(const Chunk& chunk, double took_ns, bool completed_before_wait, Pass pass) noexcept;
  /// Moves past requests of which nothing is left.
  void pass_over(Cursor& next, Pass pass) const noexcept;
  std::int64_t chunk_ns() const noexcept {
    return requests_.empty() ? 0 : requests_.front().chunk_time.count();
  }
  /// Whether chunks may be halted early: what that has discarded is within its share of the device time. A
  /// halt discards much where answers come from a second dispatch, or where elements are expensive.
  bool may_halt_early() const noexcept { return repeated_ns_ * repeated_divisor <= gpu_ns_; }
  /// The device time after which a chunk may be halted.
  std::chrono::nanoseconds usual_halt_after() const noexcept {
    return std::chrono::nanoseconds((may_halt_early() ? 1 : 2) * chunk_ns());
  }
  bool at_end(const Cursor& next) const noexcept { return next.request == requests_.size(); }
  /// `elements`, rounded up to a number that the device executes as fast.
  std::uint32_t at_least(std::uint32_t elements, std::size_t request, Pass pass) const noexcept;
  std::uint32_t total(std::size_t request, Pass pass) const noexcept;
  std::uint32_t per_chunk(std::size_t request, Pass pass) const noexcept;
  /// The size of a chunk, as ChunkPace::relative_size.
  double share(std::size_t request) const noexcept;
  void record(const Chunk& chunk, Pass pass, accel::Submit& lane) noexcept;
  void unpack(const Chunk& chunk, Pass pass) noexcept;
  /// The places of a request in the chunk. Misuse for a request that has none in it.
  PlaceRange part(const Chunk& chunk, std::size_t request, Pass pass) const noexcept;
  template <class Each>
  void each_part(const Chunk& chunk, Pass pass, Each each) noexcept;
  GpuQuery& query(std::size_t request) const noexcept {
    return *static_cast<GpuQuery*>(requests_[request].query);
  }

  Structures& structures_;
  Lanes& lanes_;
  const RowSource& rows_;
  const std::span<const Request> requests_;
  const TimeSpan times_;
  ExecutorCallbacks* const callbacks_;
  accel::TlasView view_;
  std::optional<std::uint32_t> slot_;    // of the view, once there is one
  bool recording_begun_ = false;         // bring_up has begun the recorder of the lane of the next chunk
  bool records_structure_work_ = false;  // and has recorded structure work in it
  bool in_later_stage_ = false;          // some query is in a stage after its first
  ChunkPace pace_;
  std::int64_t gpu_ns_ = 0;              // device time of all chunks
  std::int64_t repeated_ns_ = 0;         // of that, for elements that halts left to be executed again
  double element_ns_ = 0.0;              // of the last chunk that was not halted
  std::chrono::nanoseconds halt_after_;  // for the next chunk
  /// Chunk size of requests that the cost model does not divide, once one of them was halted before any of
  /// its elements was complete; 0: each is one chunk.
  std::uint32_t undivided_per_chunk_ = 0;
  std::size_t measured_requests_ = 0;  // in this pass, chunks of the requests before this one were measured
};

}  // namespace rtstdb::query
